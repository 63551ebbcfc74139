import { describe, expect, it } from 'vitest';
import { Camera } from '../../src/geometry/camera';
import { IDENTITY, rotate } from '../../src/geometry/rigid3';
import { add, distance, norm, type Pixel, subtract } from '../../src/geometry/vec3';
import { makeView, projectPoint } from '../../src/geometry/view';
import { lengthWords, markWords } from '../../src/scene/label_words';
import { labelPoint, linesOf, reachOf } from '../../src/scene/shapes';
import { makeMark, pictureGrid, strokesOf } from '../../src/scene/strokes';
import type { MarkForm, Shape } from '../../src/session/types';
import { boxBetween, uprightFor } from '../../src/tools/box';
import { handleLength, handleOf } from '../../src/tools/handle';
import { distanceFromPiece, needed, onPlane, planeOf, Smoother } from '../../src/tools/ink';
import { lengthBetween } from '../../src/tools/measure';
import { controlOf, TOOLS, turnOf } from '../../src/tools/tools';
import { about, between, handleDirection, turnedBy, turnedTo } from '../../src/tools/turn';
import { problemOf } from '../../src/ui/list_dialog';
import { PLAIN } from './annotations';

const camera = new Camera({
  model: 'pinhole',
  ...{ width: 640, height: 480, fx: 500, fy: 500, cx: 319.5, cy: 239.5 },
  distortion: [],
});
const view = makeView(camera, IDENTITY);
const METRIC = { metric: true, eye: undefined };
const AT = { x: 0, y: 0, z: 1 };

const mark = (shape: Shape, form: Partial<MarkForm> = {}) =>
  makeMark(
    { ...PLAIN, text: '', sizeM: 0.1, colorRgba: 0xffffffff, ...form, shape },
    { id: shape, author: 'Ann', pointInWorld: AT, hollow: false },
    METRIC,
  );

describe('a hand that draws', () => {
  it('is smoothed where it is slow, and followed where it is fast', () => {
    const jitter = new Smoother();
    const still: number[] = [];
    for (let i = 0; i < 60; ++i) still.push(jitter.add({ u: 100 + (i % 2), v: 50 }, i * 16).u);
    const spread = Math.max(...still.slice(30)) - Math.min(...still.slice(30));
    expect(spread).toBeLessThan(0.4); // of a jitter of 1 px
    const fast = new Smoother();
    let last: Pixel = { u: 0, v: 0 };
    for (let i = 0; i <= 60; ++i) last = fast.add({ u: 20 * i, v: 0 }, i * 16);
    expect(1200 - last.u).toBeLessThan(20); // less than one step behind
  });

  it('keeps the corners of its line, and no more than that', () => {
    const line = Array.from({ length: 101 }, (_, i) => ({ u: i, v: i < 50 ? 0 : i - 50 }));
    const kept = needed(line, 0.5);
    expect(kept[0]).toBe(0);
    expect(kept.at(-1)).toBe(100);
    expect(kept.length).toBeLessThanOrEqual(4);
    for (let i = 0; i < line.length; ++i) {
      const to = kept.findIndex((k) => k >= i);
      const [a, b] = [kept[Math.max(to - 1, 0)]!, kept[to]!];
      expect(distanceFromPiece(line[i], line[a], line[b])).toBeLessThanOrEqual(0.5);
    }
  });

  it('lies in the surface that was pressed', () => {
    const normalInWorld = { x: 0, y: Math.SQRT1_2, z: Math.SQRT1_2 };
    const target = { kind: 'point', pointInWorld: AT } as const;
    const landing = { target, pointInWorld: AT, sigmaM: 0, depthM: 1, how: 'plane' } as const;
    const slanted = onPlane(view, planeOf({ ...landing, normalInWorld }, view), { u: 300, v: 300 });
    const off = subtract(slanted!, AT);
    expect(off.y * Math.SQRT1_2 + off.z * Math.SQRT1_2).toBeCloseTo(0, 12);
    const facing = onPlane(view, planeOf(landing, view), { u: 300, v: 300 });
    expect(facing!.z).toBeCloseTo(1, 12);
  });
});

describe('turning', () => {
  it('brings the handle under the pointer', () => {
    for (const pixel of [
      { u: 340, v: 180 },
      { u: 260, v: 260 },
    ]) {
      const turned = turnedTo(view, pixel, AT, 0.2, undefined)!;
      const handle = add(AT, scaled(handleDirection(turned), 0.2));
      const at = projectPoint(view, handle)!;
      expect(Math.hypot(at.u - pixel.u, at.v - pixel.v)).toBeLessThan(1e-6);
    }
  });

  it('stays on the half of the sphere it was on, and turns on beyond its rim', () => {
    const near = turnedBy(view, undefined, 0.6, true);
    const before = handleDirection(near).z;
    const after = handleDirection(turnedTo(view, { u: 350, v: 200 }, AT, 0.2, near)).z;
    expect(Math.sign(after)).toBe(Math.sign(before));
    const out = handleDirection(turnedTo(view, { u: 600, v: 239.5 }, AT, 0.2, undefined));
    expect(out.x).toBeGreaterThan(0.8);
  });

  it('by keys goes round in 24 steps', () => {
    let q = about({ x: 0, y: 0, z: 1 }, 0);
    for (let i = 0; i < 24; ++i) q = turnedBy(view, q, Math.PI / 12, false);
    expect(distance(handleDirection(q), { x: 0, y: -1, z: 0 })).toBeLessThan(1e-9);
    const opposite = between({ x: 0, y: 1, z: 0 }, { x: 0, y: -1, z: 0 });
    expect(distance(rotate(opposite, { x: 0, y: 1, z: 0 }), { x: 0, y: -1, z: 0 })).toBeLessThan(
      1e-9,
    );
  });

  it('has its handle at the tail of an arrow, and above a box', () => {
    const arrow = mark('arrow');
    expect(handleLength(arrow)).toBeCloseTo(0.2, 12);
    expect(handleOf(view, arrow)!.v).toBeCloseTo(239.5 - 100, 6);
    const box = mark('box', { extentM: { x: 0.2, y: 0.1, z: 0.2 } });
    expect(handleLength(box)).toBeGreaterThan(0.05);
  });
});

const scaled = (v: { x: number; y: number; z: number }, s: number) => ({
  x: v.x * s,
  y: v.y * s,
  z: v.z * s,
});

describe('a box', () => {
  it('reaches from corner to corner, upright, and is as deep as it needs to be seen', () => {
    const turned = makeView(camera, {
      rotation: about({ x: 0, y: 1, z: 0 }, 0.7),
      translation: { x: 0, y: 0, z: 0 },
    });
    const right = rotate(uprightFor(turned), { x: 1, y: 0, z: 0 });
    expect(
      distance(right, rotate(turned.worldFromCamera.rotation, { x: 1, y: 0, z: 0 })),
    ).toBeCloseTo(0, 9);
    const drawn = boxBetween(view, { x: 0, y: 0, z: 1 }, { x: 0.3, y: 0.2, z: 1 });
    expect(drawn.extentM.x).toBeCloseTo(0.3, 9);
    expect(drawn.extentM.y).toBeCloseTo(0.2, 9);
    expect(drawn.extentM.z).toBeCloseTo(0.1, 9);
    expect(drawn.middleInWorld.x).toBeCloseTo(0.15, 9);
  });
});

describe('a distance', () => {
  const landing = (x: number, sigmaM: number | undefined) => ({
    target: { kind: 'point', pointInWorld: AT } as const,
    ...{ pointInWorld: { x, y: 0, z: 1 }, sigmaM, depthM: 1, how: 'plane' as const },
  });

  it('says its length and how sure it is', () => {
    const { lengthM, sigmaM } = lengthBetween(landing(0, 0.003), landing(0.25, 0.003));
    expect(lengthWords(lengthM, sigmaM, true)).toBe('250 ± 4 mm');
    expect(lengthWords(1.2345, 0.002, true)).toBe('1.23 ± 0.01 m');
    expect(lengthWords(0.25, 0.01, false)).toBe('0.250 ± 0.010, no scale');
  });

  it('of an unknown depth is as unsure as it is long', () => {
    const { sigmaM } = lengthBetween(landing(0, undefined), landing(0.25, 0));
    expect(sigmaM).toBeCloseTo(0.25, 12);
  });
});

describe('shapes', () => {
  const items = [
    { text: 'close valve', done: true, doneBy: 'Bo' },
    { text: 'open lid', done: false, doneBy: '' },
  ];

  it('say what they are about', () => {
    const words = (shape: Shape, form: Partial<MarkForm> = {}) =>
      markWords(mark(shape, form), true);
    expect(words('note')).toBe('note');
    expect(words('pin', { number: 7 })).toBe('7');
    expect(words('pin', { number: 7, text: 'here' })).toBe('7: here');
    expect(words('measure', { lengthM: 0.123, lengthSigmaM: 0.0042, text: 'gap' })).toBe(
      'gap: 123 ± 4 mm',
    );
    expect(words('check_list', { text: 'pump', checkItems: items })).toBe(
      'pump 1/2\n☑ close valve\n☐ open lid',
    );
  });

  it('say the first line only, until they are chosen', () => {
    const list = mark('check_list', { text: 'pump', checkItems: items });
    const [label] = strokesOf(view, [list], ['check_list']).labels;
    expect(label!.text).toBe('pump 1/2…');
    expect(label!.whole).toBe('pump 1/2\n☑ close valve\n☐ open lid · Ann');
    expect(strokesOf(view, [mark('cube')]).labels).toHaveLength(0);
    expect(strokesOf(view, [mark('cube')], ['cube']).labels[0]!.whole).toBe('Ann');
  });

  it('keep within their reach, so that what is behind can be left out', () => {
    const forms: [Shape, Partial<MarkForm>][] = [
      ['cube', {}],
      ['note', {}],
      ['arrow', { worldFromMark: about({ x: 1, y: 0, z: 0 }, 1) }],
      ['ink', { inkOffsetsM: [AT, { x: 2, y: 0, z: 0 }] }],
      ['box', { extentM: { x: 1, y: 2, z: 3 }, worldFromMark: about({ x: 0, y: 0, z: 1 }, 1) }],
      ['measure', { inkOffsetsM: [{ x: 0.3, y: 0, z: 0 }] }],
      ['pin', {}],
      ['picture', { picture: { sha256: '', width: 10, height: 40 } }],
      ['check_list', {}],
    ];
    for (const [shape, form] of forms) {
      const made = mark(shape, form);
      const points = [...linesOf(made, view).flat(), labelPoint(made)];
      const far = Math.max(...points.map((point) => distance(point, AT)));
      expect(far, shape).toBeLessThanOrEqual(reachOf(made) + 1e-9);
    }
  });

  it('ticks the ends of a measure across it', () => {
    const lines = linesOf(mark('measure', { inkOffsetsM: [{ x: 0.4, y: 0, z: 0 }] }), view);
    expect(lines).toHaveLength(3);
    const [a, b] = lines[1]!;
    expect(distance(a!, b!)).toBeCloseTo(0.04, 9); // 0.2 s to each side
    expect(Math.abs(subtract(b!, a!).x)).toBeLessThan(1e-9);
  });

  it('turn a picture to whoever looks, upright', () => {
    const made = mark('picture', { picture: { sha256: '', width: 200, height: 100 } });
    const grid = pictureGrid(view, made, 2);
    expect(grid).toHaveLength(3);
    const [[left, , right] = [], , [below] = []] = grid;
    expect(right!.u - left!.u).toBeCloseTo(50, 6);
    expect(below!.v - left!.v).toBeCloseTo(25, 6);
    expect(norm(subtract(labelPoint(made), AT))).toBeCloseTo(0.05, 9);
  });
});

describe('a check list that is written', () => {
  it('says which line cannot be kept', () => {
    expect(problemOf({ text: '', items: [] })).toMatch(/at least one/);
    expect(problemOf({ text: '', items: Array.from({ length: 31 }, () => 'x') })).toMatch(/31/);
    expect(problemOf({ text: '', items: ['a', 'ä'.repeat(51)] })).toMatch(/^Line 2 has 102 bytes/);
    expect(problemOf({ text: 'pump', items: ['a'] })).toBe('');
  });
});

describe('keys', () => {
  const press = (key: string, more: Partial<Parameters<typeof controlOf>[0]> = {}) => ({
    ...{ key, ctrlKey: false, altKey: false, metaKey: false, shiftKey: false },
    ...more,
  });

  it('are one for each tool, and copy only with Ctrl', () => {
    for (const { key, name } of TOOLS) expect(controlOf(press(key))).toBe(name);
    expect(controlOf(press('c', { ctrlKey: true }))).toBe('copy');
    expect(controlOf(press('v', { metaKey: true }))).toBe('paste');
    expect(controlOf(press('b', { ctrlKey: true }))).toBeUndefined();
  });

  it('turn either way, and tip with Shift on any keyboard', () => {
    expect(turnOf(press(','))).toEqual({ sign: -1, tips: false });
    expect(turnOf(press('>', { shiftKey: true }))).toEqual({ sign: 1, tips: true });
    expect(turnOf(press(':', { shiftKey: true }))).toEqual({ sign: 1, tips: true });
    expect(turnOf(press('x'))).toBeUndefined();
  });
});
