import type { Annotation } from '../session/types';

/** Which marks are listed and drawn. */
export interface MarkFilter {
  readonly text: string;
  readonly mine: boolean;
}

/** Whose marks are mine: the person's; of marks made before persons were known, the name's. */
export interface Me {
  readonly name: string;
  readonly personId: string;
}

export const isMine = (
  { author, authorPersonId }: Pick<Annotation, 'author' | 'authorPersonId'>,
  { name, personId }: Me,
): boolean => (authorPersonId === '' ? author === name : authorPersonId === personId);

export const NO_FILTER: MarkFilter = { text: '', mine: false };

export const isFiltering = ({ text, mine }: MarkFilter): boolean => mine || text.trim() !== '';

const plain = (text: string): string =>
  text
    .normalize('NFKD')
    .replace(/\p{M}+/gu, '')
    .toLocaleLowerCase();

/**
 * True if it passes: every word of `text` is in what is written on it, in its shape or in its author's
 * name, whatever the case and the accents.
 */
export function passes(
  mark: Pick<Annotation, 'text' | 'author' | 'authorPersonId' | 'shape' | 'checkItems' | 'number'>,
  filter: MarkFilter,
  me: Me,
): boolean {
  if (filter.mine && !isMine(mark, me)) return false;
  if (filter.text.trim() === '') return true;
  const { text, author, shape, checkItems, number } = mark;
  const items = checkItems.map((item) => item.text).join(' ');
  const said = plain(`${text} ${items} ${author} ${shape.replace('_', ' ')} ${number || ''}`);
  return plain(filter.text)
    .split(/\s+/)
    .every((word) => said.includes(word));
}
