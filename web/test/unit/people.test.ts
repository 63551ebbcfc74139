import { create } from '@bufbuild/protobuf';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { AnnotationEventSchema } from '../../src/gen/saccade/v1/session_pb';
import {
  AnnotationSchema,
  type CreateAnnotationRequest,
  CreateAnnotationResponseSchema,
  type UpdateAnnotationRequest,
  UpdateAnnotationResponseSchema,
} from '../../src/gen/saccade/v1/annotation_pb';
import {
  PointerEventSchema,
  PointerKind,
  type PointRequest,
} from '../../src/gen/saccade/v1/pointer_pb';
import { AnnotationBook } from '../../src/session/annotation_book';
import { Edits } from '../../src/session/edits';
import { isNameless } from '../../src/session/name';
import { personKey } from '../../src/session/person';
import { PointerBook } from '../../src/session/pointers';
import { Pointing } from '../../src/session/pointing';
import { Session } from '../../src/session/session';
import type { Annotation, Target } from '../../src/session/types';
import type { Clients } from '../../src/transport/clients';
import { whyNotChange } from '../../src/ui/rights';
import { PLAIN } from './annotations';

type FakeTimers = NonNullable<Parameters<typeof vi.useFakeTimers>[0]>['toFake'];

const pictures = { decode: () => undefined, reset: () => undefined, behind: false };
const options = { role: 'expert', view: 'raw', name: 'Ann' } as const;

const memory = (): Pick<Storage, 'getItem' | 'setItem'> => {
  const kept = new Map<string, string>();
  return { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) };
};

describe('a person', () => {
  it('is made once at a browser, as the server takes it', () => {
    const storage = memory();
    const key = personKey(storage);
    expect(key).toMatch(/^[A-Za-z0-9_-]{32,64}$/);
    expect(personKey(storage)).toBe(key);
    expect(personKey(memory())).not.toBe(key);
  });

  it('is another one where nothing, or nonsense, is kept', () => {
    const deaf = { getItem: () => 'too short', setItem: () => undefined };
    expect(personKey(deaf)).toMatch(/^[A-Za-z0-9_-]{32}$/);
    const full = {
      getItem: () => null,
      setItem: () => {
        throw new Error('full');
      },
    };
    expect(personKey(full)).toMatch(/^[A-Za-z0-9_-]{32}$/);
  });

  it('is asked for a name once', () => {
    const storage = memory();
    expect(isNameless('', storage)).toBe(true);
    expect(isNameless('?name=Bo', storage)).toBe(false);
    storage.setItem('saccade.name', 'Ann');
    expect(isNameless('', storage)).toBe(false);
  });
});

describe('what others point at', () => {
  const say = (book: PointerBook, fields: object, nowMs = 0): void => {
    const pointer = { participantId: 'b', displayName: 'Bo', strokeId: 's', ...fields };
    book.apply(create(PointerEventSchema, { pointers: [pointer] }), 'me', nowMs);
  };
  const at = (x: number) => ({ x, y: 0, z: 1 });

  it('is the newest point of a laser, and not one of mine', () => {
    const book = new PointerBook();
    say(book, { kind: PointerKind.LASER, pointsInWorldM: [at(1), at(2)] });
    say(book, { kind: PointerKind.LASER, pointsInWorldM: [at(9)], participantId: 'me' });
    expect(book.list(0).map(({ points }) => points)).toEqual([[at(2)]]);
    say(book, { kind: PointerKind.LASER, released: true });
    expect(book.list(0)).toEqual([]);
  });

  it('grows a stroke in its order, also where a part comes twice', () => {
    const book = new PointerBook();
    const grow = (first: number, ...xs: number[]) =>
      say(book, { kind: PointerKind.SKETCH, first, pointsInWorldM: xs.map(at) });
    grow(0, 0, 1);
    grow(2, 2);
    grow(1, 1, 2, 3);
    expect(book.list(0)[0]!.points.map(({ x }) => x)).toEqual([0, 1, 2, 3]);
  });

  it('goes on with the whole stroke after a silence, which the server told as its end', () => {
    const book = new PointerBook();
    say(book, { kind: PointerKind.SKETCH, first: 0, pointsInWorldM: [at(0), at(1)] });
    say(book, { kind: PointerKind.SKETCH, released: true });
    expect(book.list(0)).toEqual([]);
    say(book, { kind: PointerKind.SKETCH, first: 2, pointsInWorldM: [at(2)] });
    expect(book.list(0)[0]!.points.map(({ x }) => x)).toEqual([0, 1, 2]);
    // Nor is it lost where nothing was heard for long.
    expect(book.list(5000)).toEqual([]);
    say(book, { kind: PointerKind.SKETCH, first: 3, pointsInWorldM: [at(3)] }, 5000);
    expect(book.list(5000)[0]!.points.map(({ x }) => x)).toEqual([0, 1, 2, 3]);
    say(book, { kind: PointerKind.SKETCH, strokeId: 'next', first: 0, pointsInWorldM: [at(7)] });
    expect(book.list(0)[0]!.points.map(({ x }) => x)).toEqual([7]);
  });

  it('ends with its own stroke, and after a silence', () => {
    const book = new PointerBook();
    say(book, { kind: PointerKind.LASER, pointsInWorldM: [at(1)], strokeId: 'new' });
    say(book, { kind: PointerKind.LASER, released: true, strokeId: 'old' });
    expect(book.list(1000)).toHaveLength(1);
    expect(book.list(2000)).toHaveLength(0);
  });

  it('is told to whoever draws it at once, with what is new already in the book', () => {
    const book = new PointerBook();
    const drawn: number[] = [];
    book.heard = () => drawn.push(book.list(0).length);
    say(book, { kind: PointerKind.LASER, pointsInWorldM: [at(1)] });
    say(book, { kind: PointerKind.LASER, released: true });
    expect(drawn).toEqual([1, 0]);
  });

  it('is told to whoever measures, and nothing of it is kept', () => {
    const book = new PointerBook();
    for (let i = 0; i < 50; ++i) say(book, { kind: PointerKind.LASER, pointsInWorldM: [at(i)] });
    expect(performance.getEntriesByName('saccade.pointer.heard')).toHaveLength(0);
  });
});

describe('pointing', () => {
  const toFake = ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance'];
  beforeEach(() => void vi.useFakeTimers({ toFake: toFake as FakeTimers }));
  afterEach(() => void vi.useRealTimers());

  const TRIP_MS = 5;
  const pointing = (kind: 'laser' | 'sketch') => {
    const sent: PointRequest[] = [];
    const clients = {
      pointers: {
        point: (request: PointRequest) => {
          sent.push(request);
          return new Promise((resolve) => setTimeout(resolve, TRIP_MS));
        },
      },
    } as unknown as Clients;
    const session = new Session(clients, options, pictures);
    return { sent, pointing: new Pointing(session, kind, 0xff0000ff, () => undefined) };
  };
  const target = (x: number): Target => ({ kind: 'point', pointInWorld: { x, y: 0, z: 1 } });
  const xs = ({ points }: PointRequest): (number | undefined)[] =>
    points.map(({ target: t }) => (t.case === 'pointInWorldM' ? t.value.x : undefined));

  it('asks at most 60 times a second, with what is newest', async () => {
    const { sent, pointing: laser } = pointing('laser');
    for (let i = 0; i < 1000; ++i) {
      laser.add(target(i));
      await vi.advanceTimersByTimeAsync(1);
    }
    laser.end();
    await vi.advanceTimersByTimeAsync(100);
    expect(sent.length).toBeGreaterThan(50);
    expect(sent.length).toBeLessThanOrEqual(62);
    expect(sent.every(({ points }) => points.length <= 1)).toBe(true);
    expect(sent.at(-1)!.released).toBe(true);
    expect(sent.filter(({ released }) => released)).toHaveLength(1);
  });

  it('sends every point of a stroke once, in order, 64 at most together', async () => {
    const { sent, pointing: sketch } = pointing('sketch');
    for (let i = 0; i < 300; ++i) sketch.add(target(i));
    await vi.advanceTimersByTimeAsync(200);
    for (let i = 300; i < 310; ++i) sketch.add(target(i));
    sketch.end();
    await vi.advanceTimersByTimeAsync(500);
    expect(sent.flatMap(xs)).toEqual(Array.from({ length: 310 }, (_, i) => i));
    expect(Math.max(...sent.map(({ points }) => points.length))).toBeLessThanOrEqual(64);
    expect(sent.filter(({ released }) => released)).toHaveLength(1);
    expect(sent.at(-1)!.released).toBe(true);
  });

  it('is not forgotten while it is held still', async () => {
    const { sent, pointing: laser } = pointing('laser');
    laser.add(target(1));
    await vi.advanceTimersByTimeAsync(3000);
    expect(sent.length).toBeGreaterThanOrEqual(4);
    laser.end();
    await vi.advanceTimersByTimeAsync(3000);
    expect(sent.at(-1)!.released).toBe(true);
    const count = sent.length;
    await vi.advanceTimersByTimeAsync(3000);
    expect(sent.length).toBe(count);
  });
});

const annotation = (id: string): Annotation => ({
  ...PLAIN,
  ...{ id, shape: 'cube', text: '', author: 'Ann', sizeM: 0.05, colorRgba: 0xffffffff },
  createdMs: 0,
  anchor: {
    ...{ state: 'tracking', pointInWorld: { x: 0, y: 0, z: 1 }, covariance: undefined },
    ...{ errorMm: 1, errorPx: 1, reason: '' },
  },
});

describe('marks that are about to change', () => {
  it('are shown as they would be, until that is over', () => {
    const book = new AnnotationBook();
    book.put(annotation('a'));
    const before = book.list();
    expect(book.list()).toBe(before); // nothing changed, nothing is made anew
    book.preview('a', (each) => ({ ...each, text: 'moved' }));
    expect(book.list()[0]!.text).toBe('moved');
    expect(book.get('a')!.text).toBe('');
    book.endPreview('a');
    expect(book.list()[0]!.text).toBe('');
  });

  it('count as changes of the list only where they are more than estimates', () => {
    const book = new AnnotationBook();
    book.apply(
      create(AnnotationEventSchema, { upserted: [create(AnnotationSchema, { id: 'a' })] }),
    );
    const { changes, version } = book;
    book.apply(create(AnnotationEventSchema, { anchors: [{ id: 'a' }] }));
    expect(book.changes).toBe(changes);
    expect(book.version).toBeGreaterThan(version);
  });
});

describe('edits', () => {
  const made = () => {
    const drafts: CreateAnnotationRequest[] = [];
    const updates: UpdateAnnotationRequest[] = [];
    const clients = {
      annotations: {
        create: (request: CreateAnnotationRequest) => {
          drafts.push(request);
          const reply = { annotation: create(AnnotationSchema, { id: 'n' }) };
          return Promise.resolve(create(CreateAnnotationResponseSchema, reply));
        },
        update: (request: UpdateAnnotationRequest) => {
          updates.push(request);
          return Promise.resolve(create(UpdateAnnotationResponseSchema, {}));
        },
      },
    } as unknown as Clients;
    return { drafts, updates, edits: new Edits(new Session(clients, options, pictures)) };
  };
  const pixel = { kind: 'pixel', frameId: 7, pixel: { u: 1, v: 2 } } as const;
  const common = { text: '', colorRgba: 1, guessInWorld: undefined };

  it('send ink as pixels of its frame, and by offsets where there is none', async () => {
    const { drafts, edits } = made();
    const inkPx = [pixel.pixel, { u: 3, v: 4 }];
    const inkOffsetsM = [
      { x: 0, y: 0, z: 0 },
      { x: 1, y: 0, z: 0 },
    ];
    await edits.place({ ...common, shape: 'ink', target: pixel, inkPx, inkOffsetsM });
    const point = { kind: 'point', pointInWorld: { x: 0, y: 0, z: 1 } } as const;
    await edits.place({ ...common, shape: 'ink', target: point, inkPx, inkOffsetsM });
    expect(drafts.map(({ draft }) => [draft!.inkPx.length, draft!.inkOffsetM.length])).toEqual([
      [2, 0],
      [0, 2],
    ]);
  });

  it('send a measure with its other end, and a copy of one with its offset', async () => {
    const { drafts, edits } = made();
    const measure = { ...common, shape: 'measure', target: pixel } as const;
    const inkOffsetsM = [{ x: 1, y: 0, z: 0 }];
    await edits.place({ ...measure, inkOffsetsM, end: { target: pixel, guessInWorld: undefined } });
    await edits.place({ ...measure, inkOffsetsM, editGroup: 'g' });
    expect(drafts.map(({ draft }) => draft!.endTarget?.target.case)).toEqual([
      'framePixel',
      undefined,
    ]);
    expect(drafts.map(({ draft }) => draft!.inkOffsetM.length)).toEqual([0, 1]);
    expect(drafts[1]!.editGroup).toBe('g');
  });

  it('change only what they say', async () => {
    const { updates, edits } = made();
    await edits.change('a', { locked: true }, 'g');
    await edits.change('a', { place: { target: pixel, guessInWorld: undefined } });
    expect(updates[0]).toMatchObject({ id: 'a', locked: true, editGroup: 'g' });
    expect(Object.keys(updates[0]!)).not.toContain('text');
    expect(updates[1]!.target?.target.case).toBe('framePixel');
  });
});

describe('who may change a mark', () => {
  const session = (role: 'expert' | 'wearer' | 'viewer', personId: string) => ({
    participants: [{ participantId: 'me', name: 'Bo', role, personId, colorRgba: 0 }],
    ...{ participantId: 'me', joined: { personId } },
  });
  const locked = { ...annotation('a'), locked: true, authorPersonId: 'ann' };

  it('is said before it is tried', () => {
    expect(whyNotChange(session('expert', 'ann'), locked)).toBeUndefined();
    expect(whyNotChange(session('wearer', 'cy'), locked)).toBeUndefined();
    expect(whyNotChange(session('expert', 'bo'), locked)).toMatch(/^Locked by Ann/);
    expect(whyNotChange(session('expert', 'bo'), { ...locked, locked: false })).toBeUndefined();
    expect(whyNotChange(session('viewer', 'ann'), locked)).toMatch(/viewer/);
  });
});
