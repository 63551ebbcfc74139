import { describe, expect, it } from 'vitest';
import { Camera } from '../../src/geometry/camera';
import { IDENTITY } from '../../src/geometry/rigid3';
import { distance, type Vec3 } from '../../src/geometry/vec3';
import { makeView, projectPoint } from '../../src/geometry/view';
import { linesOf } from '../../src/scene/shapes';
import { markOf, strokesOf } from '../../src/scene/strokes';
import { readsRightToLeft, wrap } from '../../src/scene/wrap';
import type { Annotation, Feature } from '../../src/session/types';
import { bytesOf, cleanText, roomWords } from '../../src/tools/note_text';
import { landingInMap, landingInVideo, landingWords, ringRadius } from '../../src/tools/landing';
import { pickNearest } from '../../src/tools/pick';
import { COMMANDS, controlOf, HEAD_COMMANDS, TOOLS } from '../../src/tools/tools';
import { PLAIN } from './annotations';
import { anchorWords, crowdedWords, dated, presenceWords, statusWords } from '../../src/ui/words';

const METRIC = { metric: true, eye: IDENTITY.translation };
const NO_SCALE = { ...METRIC, metric: false };

const camera = new Camera({
  model: 'pinhole',
  width: 640,
  height: 480,
  fx: 500,
  fy: 500,
  cx: 319.5,
  cy: 239.5,
  distortion: [],
});
const view = makeView(camera, IDENTITY);

const feature = (id: number, pointInWorld: Vec3, depthKnown = true): Feature => ({
  id,
  state: 'measured',
  pointInWorld,
  covariance: [1e-6, 0, 0, 1e-6, 0, 4e-6],
  depthKnown,
  pixel: undefined,
  matchedCount: 9,
});

/** A wall at z = 2. */
const wall = [-0.4, -0.2, 0, 0.2, 0.4].flatMap((x, i) =>
  [-0.3, 0, 0.3].map((y, k) => feature(10 * i + k, { x, y, z: 2 })),
);

describe('landing', () => {
  it('takes a feature within 20 px, with its own uncertainty', () => {
    const landing = landingInVideo(view, 42, { u: 319.5 + 8, v: 239.5 }, wall);
    expect(landing?.how).toBe('feature');
    // Its depth, on the ray of the click.
    expect(landing?.pointInWorld.x).toBeCloseTo((2 * 8) / 500, 9);
    expect(landing?.pointInWorld.z).toBeCloseTo(2, 9);
    expect(landing?.sigmaM).toBeCloseTo(0.002, 9);
    expect(landing?.target).toEqual({ kind: 'pixel', frameId: 42, pixel: { u: 327.5, v: 239.5 } });
    expect(landing && ringRadius(view, landing)).toBeCloseTo((500 * 0.002) / 2, 6);
    expect(landing && landingWords(view, landing, true)).toBe('±2 mm');
    expect(landing && landingWords(view, landing, false)).toBe('±1 px'); // no scale, no metres
  });

  it('takes the plane of the features around', () => {
    const landing = landingInVideo(view, 1, { u: 344.5, v: 275 }, wall);
    expect(landing?.how).toBe('plane');
    expect(landing?.pointInWorld.z).toBeCloseTo(2, 9);
  });

  it('guesses the depth from afar and says so', () => {
    const landing = landingInVideo(view, 1, { u: 630, v: 20 }, wall);
    expect(landing?.how).toBe('nearby depth');
    expect(landing?.sigmaM).toBeCloseTo(0.6, 6);
    expect(landing && landingWords(view, landing, true)).toBe('±60 cm, depth guessed');
    expect(landing && landingWords(view, landing, false)).toBe('±150 px, depth guessed');
  });

  it('does not pretend to know a depth without a map', () => {
    const unknown = landingInVideo(view, 1, { u: 100, v: 100 }, [
      feature(1, { x: 0, y: 0, z: 3 }, false),
    ]);
    expect(unknown?.how).toBe('unknown depth');
    expect(unknown && ringRadius(view, unknown)).toBeUndefined();
    expect(landingInMap(view, { u: 100, v: 100 }, { features: [] })).toBeUndefined();
  });

  it('lands nowhere in an empty corner of the map, however far the rest reaches', () => {
    expect(landingInMap(view, { u: 630, v: 20 }, { features: wall })).toBeUndefined();
    expect(landingInVideo(view, 1, { u: 630, v: 20 }, wall)?.how).toBe('nearby depth');
  });

  it('in the map names the feature, or the ray', () => {
    const on = landingInMap(view, { u: 319.5, v: 239.5 }, { features: wall });
    expect(on?.target.kind).toBe('feature');
    const beside = landingInMap(view, { u: 344.5, v: 275 }, { features: wall });
    expect(beside?.target).toMatchObject({ kind: 'ray', originInWorld: { x: 0, y: 0, z: 0 } });
  });
});

describe('pickNearest', () => {
  it('takes the nearest within the radius', () => {
    const pick = (u: number) =>
      pickNearest(view, { u, v: 239.5 }, wall, (f) => f.pointInWorld, 10)?.id;
    expect(pick(321)).toBe(21);
    expect(pick(345)).toBeUndefined();
  });
});

const annotation: Annotation = {
  ...PLAIN,
  id: 'a',
  shape: 'cube',
  text: '',
  author: 'ada',
  sizeM: 0.05,
  colorRgba: 0xffffffff,
  createdMs: 0,
  inkOffsetsM: [],
  anchor: {
    state: 'tracking',
    pointInWorld: { x: 0, y: 0, z: 1 },
    covariance: undefined,
    errorMm: 3.04,
    errorPx: 0.84,
    reason: '',
  },
};
const withAnchor = (anchor: Partial<Annotation['anchor']>): Annotation => ({
  ...annotation,
  anchor: { ...annotation.anchor, ...anchor },
});
const paused: Annotation = {
  ...annotation,
  anchor: { ...annotation.anchor, state: 'paused', reason: 'tracking lost' },
};

describe('strokes', () => {
  it('draws a cube of 12 edges about its anchor', () => {
    const edges = linesOf(markOf(annotation, METRIC)!, view);
    expect(edges).toHaveLength(12);
    for (const [a, b] of edges) expect(distance(a!, b!)).toBeCloseTo(0.05, 12);
    const { strokes } = strokesOf(view, [markOf(annotation, METRIC)!]);
    const points = strokes.flatMap((stroke) => stroke.points);
    const mean = points.reduce((sum, p) => sum + p.u, 0) / points.length;
    expect(mean).toBeCloseTo(projectPoint(view, { x: 0, y: 0, z: 1 })?.u ?? NaN, 1);
  });

  it('draws hollow, and names, what is not to be trusted', () => {
    const { strokes, labels } = strokesOf(view, [markOf(paused, METRIC)!]);
    expect(strokes.every((stroke) => stroke.hollow)).toBe(true);
    expect(labels.map((label) => label.text)).toEqual(['do not trust']);
  });

  it('cuts a label between characters only, and keeps all of it beside', () => {
    const text = `${'👩‍🔧'.repeat(39)} prüfen!`;
    const [label] = strokesOf(view, [markOf({ ...annotation, text }, METRIC)!]).labels;
    expect(label?.text).toBe(`${'👩‍🔧'.repeat(39)}…`);
    expect(label?.whole).toBe(text);
  });
});

describe('wrap', () => {
  const most = (n: number) => (line: string) => line.length <= n;

  it('loses nothing, at spaces and without any', () => {
    expect(wrap('one two three', most(8))).toEqual(['one two', 'three']);
    expect(wrap('检查这个阀门是否漏油', most(4))).toEqual(['检查这个', '阀门是否', '漏油']);
    const long = `see ${'x'.repeat(11)} and this`;
    expect(wrap(long, most(5)).join('').replaceAll(' ', '')).toBe(long.replaceAll(' ', ''));
    expect(wrap('', most(5))).toEqual(['']);
  });

  it('knows where a line begins', () => {
    expect(readsRightToLeft('5 בדוק')).toBe(true);
    expect(readsRightToLeft('افحص valve')).toBe(true);
    expect(readsRightToLeft('Größe בדוק')).toBe(false);
    expect(readsRightToLeft('42')).toBe(false);
  });
});

describe('the text of a note', () => {
  it('is counted in bytes, as the server does, and cut nowhere', () => {
    expect(bytesOf('Größe ✓')).toBe(11);
    expect(roomWords('ä'.repeat(250))).toEqual({ text: '0 of 500 bytes left', over: false });
    expect(roomWords('ä'.repeat(250) + 'x')).toEqual({
      text: '1 byte too long: shorten it',
      over: true,
    });
    expect(cleanText(' a\nb\t')).toBe('a b');
  });
});

describe('words', () => {
  it('gives an anchor its error, or the reason not to trust it', () => {
    expect(anchorWords(annotation, METRIC)).toEqual({ text: '0.8 px · 3.0 mm', warn: false });
    expect(anchorWords(annotation, NO_SCALE).text).toBe('0.8 px · scale unknown');
    expect(anchorWords(paused, METRIC)).toEqual({
      text: 'do not trust: tracking lost',
      warn: true,
    });
  });

  it('date what is told while nothing new is heard', () => {
    const { text } = anchorWords(annotation, METRIC);
    expect(dated(text, undefined)).toBe('0.8 px · 3.0 mm');
    expect(dated(text, 12_300)).toBe('0.8 px · 3.0 mm · as of 12 s ago');
    expect(dated(text, 600_000)).toBe('0.8 px · 3.0 mm · as of 10 min ago');
  });

  it('do not trust a provisional mark above its limit, nor give its error in millions', () => {
    const { errorPx, errorMm } = { errorPx: 4, errorMm: 23_087 };
    const wide = withAnchor({ state: 'provisional', errorPx, errorMm });
    expect(anchorWords(wide, METRIC)).toEqual({
      text: 'do not trust: expected error 23.1 m',
      warn: true,
    });
    expect(markOf(wide, METRIC)?.hollow).toBe(true);
    const coarse = withAnchor({ state: 'provisional', errorPx: 14, errorMm: 4 });
    expect(anchorWords(coarse, METRIC).text).toBe('do not trust: expected error 14.0 px');
    const young = withAnchor({ state: 'provisional', errorPx: 2, errorMm: 9 });
    expect(anchorWords(young, METRIC)).toEqual({ text: '2.0 px · 9.0 mm', warn: false });
    expect(markOf(young, METRIC)?.hollow).toBe(false);
    // Far away the server allows a share of the distance: 2 % of 4 m.
    const pointInWorld = { x: 0, y: 0, z: 4 };
    const far = withAnchor({ state: 'provisional', errorPx, errorMm: 79, pointInWorld });
    expect(markOf(far, METRIC)?.hollow).toBe(false);
    expect(markOf({ ...far, anchor: { ...far.anchor, errorMm: 81 } }, METRIC)?.hollow).toBe(true);
  });

  it('give no millimetres without scale, whoever says them', () => {
    const reason = 'expected error 700 mm is above 50 mm';
    for (const state of ['provisional', 'tracking', 'paused'] as const) {
      const { text } = anchorWords(withAnchor({ state, errorMm: 700, reason }), NO_SCALE);
      expect(text).not.toMatch(/\bmm\b|\bcm\b|\d m\b/);
    }
  });

  it('ask for nothing that cannot be done here', () => {
    const reason = 'its place is not known in this map: it was placed in another one; move it';
    const { text } = anchorWords(withAnchor({ state: 'paused', reason }), METRIC);
    expect(text).not.toContain('move it');
  });

  it('say that there are too many tabs, and what to do', () => {
    const link = { kind: 'crowded', tabs: 4 } as const;
    const words = statusWords({ link, pose: undefined, sourceEnded: false, nowMs: 0 });
    expect(words).toMatchObject({ text: 'too many tabs', advice: crowdedWords(4), warn: true });
    expect(words.advice).toContain('Close 1 of them');
  });

  it('counts who is here', () => {
    expect(
      presenceWords([
        { role: 'expert', participantId: '1' },
        { role: 'wearer', participantId: '2' },
        { role: 'expert', participantId: '1' },
      ]),
    ).toBe('2 experts, 1 wearer');
    expect(presenceWords([])).toBe('');
  });

  it('never says tracking while the link is down', () => {
    const words = statusWords({
      link: { kind: 'reconnecting', reason: 'no answer from the server', sinceMs: 1000 },
      pose: undefined,
      sourceEnded: false,
      nowMs: 4200,
    });
    expect(words).toMatchObject({
      text: 'reconnecting, 3 s',
      advice: 'no answer from the server',
      warn: true,
    });
  });
});

describe('controls', () => {
  const press = (key: string, mods = {}) =>
    controlOf({ key, ctrlKey: false, altKey: false, metaKey: false, shiftKey: false, ...mods });

  it('have one key each', () => {
    const keys = [...TOOLS, ...COMMANDS, ...HEAD_COMMANDS].map(({ key }) => key);
    expect(new Set(keys).size).toBe(keys.length);
    for (const { key, name } of [...TOOLS, ...COMMANDS, ...HEAD_COMMANDS])
      expect(press(key)).toBe(name);
  });

  it('leave the browser its own shortcuts', () => {
    expect(press('r', { ctrlKey: true })).toBeUndefined();
    expect(press('z', { ctrlKey: true })).toBe('undo');
    expect(press('Z', { ctrlKey: true, shiftKey: true })).toBe('redo');
  });
});
