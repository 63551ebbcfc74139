import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { describe, expect, it, vi } from 'vitest';
import { codecOf } from '../../src/decode/h264';
import {
  FeatureSchema,
  FeatureState,
  FrameFeaturesSchema,
  MapDeltaSchema,
} from '../../src/gen/saccade/v1/map_pb';
import { AnnotationEventSchema } from '../../src/gen/saccade/v1/session_pb';
import { AnnotationSchema } from '../../src/gen/saccade/v1/annotation_pb';
import { AccessUnitSchema } from '../../src/gen/saccade/v1/video_pb';
import { Camera } from '../../src/geometry/camera';
import { Acknowledger } from '../../src/session/acknowledger';
import { AnnotationBook } from '../../src/session/annotation_book';
import { ClockOffset } from '../../src/session/clock';
import { FrameReader } from '../../src/session/frame_reader';
import { LatencyMeter, RateMeter, stageTimes } from '../../src/session/latency';
import { MapState } from '../../src/session/map_state';
import { FrameRing } from '../../src/session/ring';
import { Backoff } from '../../src/transport/backoff';

describe('FrameRing', () => {
  it('keeps the newest and finds by exact id', () => {
    const ring = new FrameRing<string>(3);
    for (let id = 1; id <= 5; ++id) ring.set(id, `f${id}`);
    expect(ring.size).toBe(3);
    expect(ring.get(2)).toBeUndefined();
    expect(ring.get(4)).toBe('f4');
    expect(ring.get(6)).toBeUndefined();
    expect(ring.atOrBefore(100)).toBe('f5');
    expect(ring.atOrBefore(2)).toBeUndefined();
  });
});

describe('ClockOffset', () => {
  it('gives the worked number of session.proto', () => {
    const clock = new ClockOffset();
    expect(clock.offsetMs).toBeUndefined();
    clock.add(0, 105, 106, 11);
    expect(clock.offsetMs).toBe(100);
  });

  it('believes the quickest ping', () => {
    const clock = new ClockOffset();
    clock.add(0, 150, 150, 60); // held up for 50 on its way there
    clock.add(100, 203, 203, 106);
    expect(clock.offsetMs).toBe(100);
    expect(clock.roundTripMs).toBe(6);
  });
});

describe('stageTimes', () => {
  const intrinsics = {
    model: 'pinhole',
    width: 4,
    height: 3,
    fx: 1,
    fy: 1,
    cx: 0,
    cy: 0,
    distortion: [],
  } as const;
  const facts = {
    frameId: 7,
    view: 'raw',
    pose: undefined,
    camera: new Camera(intrinsics),
    stages: { captured: 1000, received: 1008, tracked: 1012, encoded: 1016, queued: 1016 },
    arrivedMs: 919,
  } as const;

  it('adds up to the total', () => {
    const times = stageTimes(facts, 921, 927, 100);
    expect(times).toEqual({
      capture: 8,
      track: 4,
      encode: 4,
      network: 3,
      decode: 2,
      draw: 6,
      total: 27,
    });
  });

  it('says nothing before the clocks are known', () => {
    expect(stageTimes(facts, 921, 927, undefined)).toBeUndefined();
  });

  it('meters percentiles of the last frames only', () => {
    const meter = new LatencyMeter(10);
    for (let i = 0; i < 30; ++i) {
      meter.add({ capture: 0, track: i, encode: 0, network: 0, decode: 0, draw: 0, total: i });
    }
    expect(meter.get('track')).toEqual({ p50: 24, p95: 28 });
  });
});

describe('RateMeter', () => {
  it('counts a steady rate and falls to nothing', () => {
    const meter = new RateMeter();
    for (let t = 0; t <= 2000; t += 40) meter.add(t);
    expect(meter.rate(2000)).toBeCloseTo(25, 0);
    expect(meter.rate(9000)).toBe(0);
  });
});

describe('Acknowledger', () => {
  it('is cumulative, one at a time, and waits for the decoder', async () => {
    const sent: [bigint, boolean][] = [];
    let proceed = true;
    let answer = (): void => undefined;
    const acknowledger = new Acknowledger({
      every: 2,
      mayProceed: () => proceed,
      send: (sequence, key) => {
        sent.push([sequence, key]);
        return new Promise((resolve) => (answer = resolve));
      },
    });
    acknowledger.arrived(1n);
    expect(sent).toEqual([]);
    acknowledger.arrived(2n);
    acknowledger.arrived(3n);
    acknowledger.arrived(4n);
    expect(sent).toEqual([[2n, false]]);
    answer();
    await vi.waitFor(() => {
      acknowledger.flush();
      expect(sent).toEqual([
        [2n, false],
        [4n, false],
      ]);
    });
    answer();
    proceed = false;
    await Promise.resolve();
    acknowledger.arrived(9n);
    acknowledger.requestKeyFrame();
    await vi.waitFor(() => {
      acknowledger.flush();
      expect(sent.at(-1)).toEqual([4n, true]); // a key frame may be asked for while held back
    });
  });
});

describe('an acknowledgement', () => {
  const begin = (proceed: boolean) => {
    const sent: bigint[] = [];
    let now = 0;
    const acknowledger = new Acknowledger({
      every: 8,
      mayProceed: () => proceed,
      nowMs: () => now,
      send: (sequence) => {
        sent.push(sequence);
        return Promise.resolve();
      },
    });
    const at = async (ms: number, act: () => void) => {
      now = ms;
      act();
      await new Promise((resolve) => setTimeout(resolve, 0));
    };
    return { acknowledger, sent, at };
  };

  it('goes out every two seconds, without a timer, and also when there is nothing new', async () => {
    const { acknowledger, sent, at } = begin(true);
    await at(500, () => acknowledger.arrived(1n));
    expect(sent).toEqual([]);
    await at(2000, () => acknowledger.arrived(2n)); // a hidden page has events, but hardly timers
    await at(3900, () => acknowledger.arrived(3n));
    await at(4000, () => acknowledger.flush(8));
    await at(6000, () => acknowledger.flush());
    expect(sent).toEqual([2n, 3n, 3n]);
  });

  it('goes out now and then while the decoder is behind', async () => {
    const { acknowledger, sent, at } = begin(false);
    await at(5000, () => acknowledger.arrived(20n));
    expect(sent).toEqual([]);
    await at(6000, () => acknowledger.arrived(32n));
    expect(sent).toEqual([32n]);
  });
});

describe('MapState', () => {
  const feature = (id: bigint, u: number, state = FeatureState.MEASURED) =>
    create(FeatureSchema, { id, state, pixel: { u, v: 1 }, pointInWorldM: { x: 0, y: 0, z: 1 } });

  it('adds the parts of a state up, and keeps nothing across a reset', () => {
    const map = new MapState();
    const delta = (init: MessageInitShape<typeof MapDeltaSchema>) =>
      map.apply(create(MapDeltaSchema, init));
    delta({ full: true, mapGeneration: 1n, upserted: [feature(9n, 1)] });
    delta({ full: true, more: true, mapGeneration: 1n, upserted: [feature(1n, 10)] });
    delta({ mapGeneration: 1n, upserted: [feature(2n, 20)] });
    expect([...map.features.keys()]).toEqual([1, 2]);
    delta({
      mapGeneration: 1n,
      upserted: [feature(1n, 11, FeatureState.FAILED)],
      removedIds: [2n],
    });
    expect([...map.features.values()].map((f) => [f.id, f.state])).toEqual([[1, 'failed']]);
    delta({ mapGeneration: 2n, upserted: [feature(1n, 30)] });
    expect(map.features.size).toBe(1);
  });
});

describe('what a frame saw', () => {
  const read = (frameId: bigint, features?: MessageInitShape<typeof FrameFeaturesSchema>) => {
    const unit = create(AccessUnitSchema, {
      frameId,
      intrinsics: { widthPx: 640, heightPx: 480, fxPx: 500, fyPx: 500, cxPx: 319.5, cyPx: 239.5 },
      ...(features && { features }),
    });
    return new FrameReader().read(unit, undefined, 0)?.features;
  };

  it("is the frame's own, in sixteenths of a pixel: map.proto's worked number", () => {
    const seen = read(7n, {
      measuredIds: [5n],
      measuredPx16: [5112, 3832],
      failedIds: [6n],
      failedPx16: [16, -8],
    });
    expect([...(seen ?? [])]).toEqual([
      [6, { state: 'failed', pixel: { u: 1, v: -0.5 } }],
      [5, { state: 'measured', pixel: { u: 319.5, v: 239.5 } }],
    ]);
  });

  it('is not known where the frame does not say, whatever frames before it said', () => {
    expect(read(8n)).toBeUndefined();
    expect(read(9n, {})?.size).toBe(0);
  });
});

describe('AnnotationBook', () => {
  const event = (full: boolean, ...ids: string[]) =>
    create(AnnotationEventSchema, {
      full,
      upserted: ids.map((id, i) => create(AnnotationSchema, { id, createdUnixNs: BigInt(i) })),
    });

  it('hides at once what is being deleted, and shows it again if refused', () => {
    const book = new AnnotationBook();
    book.apply(event(true, 'a', 'b'));
    const show = book.hide('a');
    expect(book.list().map(({ id }) => id)).toEqual(['b']);
    show();
    expect(book.list().map(({ id }) => id)).toEqual(['a', 'b']);
  });

  it('takes no late answer for what has been undone, unless it is redone', () => {
    const book = new AnnotationBook();
    book.apply(event(true, 'a'));
    const answer = book.get('a')!;
    book.apply(create(AnnotationEventSchema, { removedIds: ['a'] }));
    book.put(answer);
    expect(book.list()).toEqual([]);
    book.apply(event(false, 'a'));
    book.put(answer);
    expect(book.list()).toHaveLength(1);
  });

  it('takes a list in parts, and anchors alone only for what it knows', () => {
    const book = new AnnotationBook();
    book.apply(event(true, 'old'));
    book.apply(create(AnnotationEventSchema, { ...event(true, 'a'), more: true }));
    book.apply(event(false, 'b'));
    expect(book.list().map(({ id }) => id)).toEqual(['a', 'b']);
    const { version } = book;
    const anchor = { errorMm: 3, pointInWorldM: { x: 1, y: 2, z: 3 } };
    const ids = ['a', 'never heard of'];
    book.apply(create(AnnotationEventSchema, { anchors: ids.map((id) => ({ id, anchor })) }));
    expect(book.list().map(({ id }) => id)).toEqual(['a', 'b']);
    expect(book.get('a')?.anchor).toMatchObject({ errorMm: 3, pointInWorld: { x: 1, y: 2, z: 3 } });
    expect(book.get('b')?.anchor.errorMm).toBe(0);
    expect(book.version).toBeGreaterThan(version);
  });

  it('forgets what a full list does not have', () => {
    const book = new AnnotationBook();
    book.apply(event(true, 'a', 'b'));
    book.apply(event(true, 'c'));
    expect(book.list().map(({ id }) => id)).toEqual(['c']);
  });
});

describe('Backoff', () => {
  it('grows to two seconds and starts anew', () => {
    const backoff = new Backoff(() => 0);
    expect([1, 2, 3, 4, 5].map(() => backoff.nextMs())).toEqual([250, 500, 1000, 2000, 2000]);
    backoff.reset();
    expect(backoff.nextMs()).toBe(250);
  });
});

describe('codecOf', () => {
  it('reads profile and level from the parameter set', () => {
    const unit = new Uint8Array([0, 0, 0, 1, 0x09, 0x10, 0, 0, 0, 1, 0x67, 0x42, 0xc0, 0x1e, 0x99]);
    expect(codecOf(unit)).toBe('avc1.42c01e');
    expect(codecOf(new Uint8Array([0, 0, 0, 1, 0x65, 1, 2, 3, 4]))).toBeUndefined();
  });
});
