export const MAX_TEXT_BYTES = 500; // annotation.proto

const encoder = new TextEncoder();

/** As the server counts: bytes of UTF-8. */
export const bytesOf = (text: string): number => encoder.encode(text).length;

/** One line without control characters, as the server takes it. */
export const cleanText = (text: string): string => text.replace(/\p{Cc}+/gu, ' ').trim();

/** What is left of the room, for beside the field. */
export function roomWords(text: string): { text: string; over: boolean } {
  const left = MAX_TEXT_BYTES - bytesOf(cleanText(text));
  if (left >= 0) return { text: `${left} of ${MAX_TEXT_BYTES} bytes left`, over: false };
  return { text: `${-left} ${left === -1 ? 'byte' : 'bytes'} too long: shorten it`, over: true };
}
