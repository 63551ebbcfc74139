export const MAX_NAME_BYTES = 60; // session.proto
const KEY = 'saccade.name';

/** As the server takes it: one line, at most 60 bytes of UTF-8, cut between characters. */
export function cleanName(text: string): string {
  const line = text.replace(/\p{Cc}+/gu, ' ').trim();
  const encoder = new TextEncoder();
  let name = '';
  let bytes = 0;
  for (const character of line) {
    bytes += encoder.encode(character).length;
    if (bytes > MAX_NAME_BYTES) break;
    name += character;
  }
  return name.trim();
}

/** What this person is called: as the address says (`?name=`), else as last time. */
export function recallName(search: string, storage: Pick<Storage, 'getItem'>): string {
  const given = cleanName(new URLSearchParams(search).get('name') ?? '');
  return given || cleanName(storage.getItem(KEY) ?? '') || 'expert';
}

export const keepName = (name: string, storage: Pick<Storage, 'setItem'>): void =>
  storage.setItem(KEY, name);

/** True where nobody has said yet what this person is called. */
export const isNameless = (search: string, storage: Pick<Storage, 'getItem'>): boolean =>
  cleanName(new URLSearchParams(search).get('name') ?? '') === '' &&
  cleanName(storage.getItem(KEY) ?? '') === '';
