const segmenter = 'Segmenter' in Intl ? new Intl.Segmenter() : undefined;

/** What a person counts as characters: an emoji with its modifiers is one. */
export const charactersOf = (text: string): string[] =>
  segmenter ? [...segmenter.segment(text)].map(({ segment }) => segment) : Array.from(text);
