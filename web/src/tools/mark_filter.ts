import type { Annotation } from '../session/types';

/** Which marks are listed and drawn. */
export interface MarkFilter {
  readonly text: string;
  readonly mine: boolean;
}

export const NO_FILTER: MarkFilter = { text: '', mine: false };

export const isFiltering = ({ text, mine }: MarkFilter): boolean => mine || text.trim() !== '';

const plain = (text: string): string =>
  text
    .normalize('NFKD')
    .replace(/\p{M}+/gu, '')
    .toLocaleLowerCase();

/**
 * True if it passes: every word of `text` is in what is written on it, in its shape or in its author's
 * name, whatever the case and the accents; `me`: the name whose marks are mine.
 */
export function passes(
  { text, author, shape }: Pick<Annotation, 'text' | 'author' | 'shape'>,
  filter: MarkFilter,
  me: string,
): boolean {
  if (filter.mine && author !== me) return false;
  const said = plain(`${text} ${author} ${shape}`);
  return plain(filter.text)
    .split(/\s+/)
    .every((word) => said.includes(word));
}
