import { describe, expect, it } from 'vitest';
import { PNG } from 'pngjs';
import { lostWords } from '../../src/ui/words';
import type { Pose } from '../../src/session/types';
import { NO_FILTER, passes } from '../../src/tools/mark_filter';
import { withText } from '../../src/tools/png_text';
import { controlOf } from '../../src/tools/tools';
import { PLAIN } from './annotations';

const mark = { ...PLAIN, text: 'Größe prüfen', author: 'Ann', shape: 'note' } as const;
const me = (name: string, personId = '') => ({ name, personId });

describe('finding marks', () => {
  it('asks for every word, in text, shape or author, whatever case and accents', () => {
    expect(passes(mark, NO_FILTER, me('Bo'))).toBe(true);
    expect(passes(mark, { text: 'GROSSE', mine: false }, me(''))).toBe(false); // ß is not ss
    expect(passes(mark, { text: 'große PRUFEN', mine: false }, me(''))).toBe(true);
    expect(passes(mark, { text: ' ann  note ', mine: false }, me(''))).toBe(true);
    expect(passes(mark, { text: 'ann cube', mine: false }, me(''))).toBe(false);
  });

  it('shows only mine where asked to', () => {
    expect(passes(mark, { text: '', mine: true }, me('Ann'))).toBe(true);
    expect(passes(mark, { text: '', mine: true }, me('Bo'))).toBe(false);
  });

  it('knows what is mine by the person, whatever the name', () => {
    const mine = { text: '', mine: true };
    const made = { ...mark, authorPersonId: 'p' };
    expect(passes(made, mine, me('Annette', 'p'))).toBe(true);
    expect(passes(made, mine, me('Ann', 'q'))).toBe(false);
  });

  it('finds a check list by its lines and a pin by its number', () => {
    const items = [{ text: 'close valve', done: false, doneBy: '' }];
    const list = { ...mark, shape: 'check_list', checkItems: items } as const;
    expect(passes(list, { text: 'valve check', mine: false }, me(''))).toBe(true);
    const pin = { ...mark, shape: 'pin', number: 12 } as const;
    expect(passes(pin, { text: 'pin 12', mine: false }, me(''))).toBe(true);
  });

  it('has a key each', () => {
    const key = (letter: string) =>
      controlOf({ key: letter, ctrlKey: false, altKey: false, metaKey: false, shiftKey: false });
    expect([key('o'), key('M'), key('k')]).toEqual(['mine', 'hide', 'snapshot']);
  });
});

describe('text in a PNG', () => {
  it('is a chunk that a reader accepts, and that says what was said', () => {
    const image = new PNG({ width: 3, height: 2 });
    image.data.fill(200);
    const said = JSON.stringify({ text: 'Größe ≈ 5 mm', marks: [1, 2] });
    const png = withText(new Uint8Array(PNG.sync.write(image)), 'Saccade', said);
    const back = PNG.sync.read(Buffer.from(png), { checkCRC: true });
    expect([back.width, back.height]).toEqual([3, 2]);
    const at = Buffer.from(png).indexOf('iTXt');
    const length = Buffer.from(png).readUInt32BE(at - 4);
    const data = Buffer.from(png).subarray(at + 4, at + 4 + length);
    expect(data.subarray(0, 8).toString('latin1')).toBe('Saccade\0');
    expect(data.subarray(12).toString('utf8')).toBe(said);
    expect(Buffer.from(png).subarray(-8, -4).toString('latin1')).toBe('IEND');
  });
});

describe('words in the picture of a camera that is lost', () => {
  const pose = (status: Pose['status'], advice = ''): Pose => ({
    frameId: 1,
    status,
    quality: 'unknown',
    advice,
    metric: true,
    worldFromCamera: { rotation: { x: 0, y: 0, z: 0, w: 1 }, translation: { x: 0, y: 0, z: 0 } },
    attempted: 0,
    matched: 0,
    mapRevision: 1,
    markers: [],
  });

  it('say what to do, and nothing while it is tracked', () => {
    expect(lostWords(pose('lost'))).toMatch(/^Lost: show a place seen before/);
    expect(lostWords(pose('relocalising', 'hold still'))).toMatch(
      /^Searching its place: hold still/,
    );
    expect(lostWords(pose('tracking'))).toBe('');
    expect(lostWords(undefined)).toBe('');
  });
});
