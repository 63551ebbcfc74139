import { charactersOf } from './characters';

/** Lines that `fits`, broken at spaces, and between characters where a word alone is too long. */
export function wrap(text: string, fits: (line: string) => boolean): string[] {
  const lines: string[] = [];
  let line = '';
  for (const word of text.split(/(?<= )/)) {
    if (line === '' || fits((line + word).trimEnd())) {
      line += word;
    } else {
      lines.push(line.trimEnd());
      line = word;
    }
    if (fits(line.trimEnd())) continue;
    let part = '';
    for (const character of charactersOf(line)) {
      if (part !== '' && !fits((part + character).trimEnd())) {
        lines.push(part.trimEnd());
        part = '';
      }
      part += character;
    }
    line = part;
  }
  if (line.trim() !== '' || lines.length === 0) lines.push(line.trimEnd());
  return lines;
}

/** By its first letter, as a browser decides it (dir="auto"): Hebrew, Arabic and their relatives. */
export function readsRightToLeft(text: string): boolean {
  const letter = /\p{L}/u.exec(text)?.[0] ?? '';
  return /[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufeff]/.test(letter);
}
