import { create } from '@bufbuild/protobuf';
import { describe, expect, it } from 'vitest';
import { type WearerTracked, WearerTrackedSchema } from '../../src/gen/saccade/v1/wearer_pb';
import { Camera, type Intrinsics } from '../../src/geometry/camera';
import { IDENTITY } from '../../src/geometry/rigid3';
import { uprightView } from '../../src/geometry/turned_view';
import { makeView, projectPoint } from '../../src/geometry/view';
import type { Pose } from '../../src/session/types';
import { statusWords } from '../../src/ui/words';
import { wearWords } from '../../src/ui/wear_words';
import { BitRate, held } from '../../src/uplink/back_pressure';
import { FrameTimes, refusalWords } from '../../src/uplink/camera';
import { chooseCodec } from '../../src/uplink/coder';
import { motionOf } from '../../src/uplink/motion';
import { SentRing } from '../../src/uplink/sent';
import { cropOf, swapped, swaps, type Turn, turnOf } from '../../src/uplink/turn';
import { WearMeter, wearTimes } from '../../src/uplink/wear_latency';

const WIDE = { width: 640, height: 480 };
const TALL = swapped(WIDE);

describe('turnOf', () => {
  it('lays every picture as the sensor lies, however the phone is held', () => {
    for (const taken of [WIDE, TALL]) {
      for (const angle of [0, 90, 180, 270]) {
        for (const picture of [WIDE, TALL]) {
          const turn = turnOf(picture, angle, taken);
          expect(swaps(turn) ? swapped(picture) : picture).toEqual(taken);
        }
      }
    }
  });

  it('turns a phone by what it was turned, and a laptop not at all', () => {
    expect(turnOf(WIDE, 0, WIDE)).toBe(0); // a laptop
    // A phone, whose picture stands when it stands (angle 0): wide when its top lies at the left (90).
    expect(turnOf(WIDE, 90, WIDE)).toBe(0);
    expect(turnOf(TALL, 0, WIDE)).toBe(270);
    expect(turnOf(WIDE, 270, WIDE)).toBe(180);
    expect(turnOf(TALL, 0, TALL)).toBe(0);
    expect(turnOf(WIDE, 90, TALL)).toBe(90);
  });
});

describe('cropOf', () => {
  it('takes the largest middle part of the wanted shape', () => {
    expect(cropOf({ width: 1280, height: 720 }, WIDE)).toEqual({
      x: 160,
      y: 0,
      width: 960,
      height: 720,
    });
    expect(cropOf(WIDE, WIDE)).toEqual({ x: 0, y: 0, ...WIDE });
  });
});

describe('uprightView', () => {
  const lens: Intrinsics = {
    model: 'brown_conrady',
    ...WIDE,
    fx: 500,
    fy: 510,
    cx: 300,
    cy: 250,
    distortion: [0.1, -0.05, 0.01, -0.02],
  };
  it('shows each point where the turned picture has it', () => {
    const laid = makeView(new Camera(lens), IDENTITY);
    const point = { x: 0.2, y: -0.1, z: 1 };
    const at = projectPoint(laid, point);
    if (!at) throw new Error('not in view');
    // An upright picture (u, v) of size w x h, turned clockwise, is the laid one.
    const back: Record<Turn, { u: number; v: number }> = {
      0: at,
      90: { u: at.v, v: 639 - at.u },
      180: { u: 639 - at.u, v: 479 - at.v },
      270: { u: 479 - at.v, v: at.u },
    };
    for (const turn of [0, 90, 180, 270] as const) {
      const shown = projectPoint(uprightView(lens, IDENTITY, turn), point);
      expect(shown?.u).toBeCloseTo(back[turn].u, 6);
      expect(shown?.v).toBeCloseTo(back[turn].v, 6);
    }
  });
});

describe('back-pressure', () => {
  const idle = { encoding: 0, bufferedBytes: 0, unanswered: 0, sinceSentMs: 33 };
  it('leaves out what would queue, and says where', () => {
    expect(held(idle, 2e6)).toBeUndefined();
    expect(held({ ...idle, encoding: 2 }, 2e6)).toBe('encoder');
    expect(held({ ...idle, bufferedBytes: 60_000 }, 2e6)).toBe('network');
    expect(held({ ...idle, unanswered: 10 }, 2e6)).toBe('server');
  });
  it('never waits for ever for a server that says nothing', () => {
    expect(held({ ...idle, unanswered: 999, sinceSentMs: 600 }, 2e6)).toBeUndefined();
  });
  it('goes down at once and up slowly, between bounds', () => {
    const rate = new BitRate(2_000_000);
    expect(rate.second(30)).toBe(true);
    expect(rate.now).toBe(1_400_000);
    for (let i = 0; i < 20; ++i) rate.second(30);
    expect(rate.now).toBe(300_000);
    for (let i = 0; i < 4; ++i) expect(rate.second(0)).toBe(false);
    expect(rate.second(0)).toBe(true);
    for (let i = 0; i < 100; ++i) rate.second(0);
    expect(rate.now).toBe(2_000_000);
  });
});

describe('chooseCodec', () => {
  const codecOf = async (supported: (config: VideoEncoderConfig) => boolean) =>
    (await chooseCodec(WIDE, (config) => Promise.resolve(supported(config))))?.words;
  it('prefers hardware of either kind to software', async () => {
    expect(await codecOf(() => true)).toBe('H.264');
    const hardware = ({ hardwareAcceleration: how, codec }: VideoEncoderConfig): boolean =>
      how !== 'prefer-hardware' || codec === 'vp8';
    expect(await codecOf(hardware)).toBe('VP8');
    expect(await codecOf(({ hardwareAcceleration: how }) => how !== 'prefer-hardware')).toBe(
      'H.264',
    );
    expect(await codecOf(({ codec }) => codec === 'vp8')).toBe('VP8');
    expect(await codecOf(() => false)).toBeUndefined();
  });
  it('asks for what starts anew at every key frame, without delay', async () => {
    const asked: VideoEncoderConfig[] = [];
    await chooseCodec(WIDE, (config) => {
      asked.push(config);
      return Promise.reject(new Error('unknown'));
    });
    expect(asked).toHaveLength(4);
    expect(asked.every(({ latencyMode }) => latencyMode === 'realtime')).toBe(true);
    expect(asked[0]?.avc?.format).toBe('annexb');
  });
});

describe('FrameTimes', () => {
  it('brings frame times to the page by the least delay, also after a new start', () => {
    const times = new FrameTimes();
    expect(times.capturedMs(0, 1050)).toBe(1050);
    expect(times.capturedMs(33, 1060)).toBe(1060); // 23 ms quicker than the first
    expect(times.capturedMs(66, 1150)).toBeCloseTo(1093, 1);
    expect(times.capturedMs(0, 9000)).toBe(9000); // a stream that begins again at zero
  });
});

describe('refusalWords', () => {
  it('names the cause and the remedy', () => {
    const error = (name: string) => new DOMException('', name);
    expect(refusalWords(error('NotAllowedError'), true)).toMatch(/not allowed.*then tap Start/);
    expect(refusalWords(error('NotReadableError'), true)).toMatch(/Another app.*Close it/);
    expect(refusalWords(error('NotFoundError'), true)).toMatch(/Choose another lens/);
    expect(refusalWords(error('NotAllowedError'), false)).toMatch(/https/);
  });
});

describe('motionOf', () => {
  it('is in radians about the axes of the acceleration, or nothing', () => {
    const rotationRate = { alpha: 180, beta: 90, gamma: -90 };
    const accelerationIncludingGravity = { x: 0, y: 9.8, z: 1 };
    const motion = motionOf({ timeStamp: 5, accelerationIncludingGravity, rotationRate }, 1000);
    expect(motion?.timeMs).toBe(1005);
    expect(motion?.angularVelocity[0]).toBeCloseTo(Math.PI / 2);
    expect(motion?.angularVelocity[1]).toBeCloseTo(-Math.PI / 2);
    expect(motion?.angularVelocity[2]).toBeCloseTo(Math.PI);
    const empty = { timeStamp: 5, accelerationIncludingGravity: null, rotationRate: null };
    expect(motionOf(empty, 0)).toBeUndefined();
  });
});

describe('SentRing', () => {
  it('keeps the newest, each on a canvas that is used again', () => {
    let made = 0;
    const ring = new SentRing(
      3,
      () => ({ n: ++made, width: 0, height: 0 }) as unknown as HTMLCanvasElement,
    );
    for (let i = 0; i < 10; ++i) ring.add(i, 0, WIDE);
    expect(made).toBe(3);
    expect(ring.newest?.pictureId).toBe(10);
    expect(ring.find(8)?.capturedMs).toBe(7);
    expect(ring.find(7)).toBeUndefined();
    expect(ring.add(11, 90, TALL).picture.width).toBe(480);
  });
});

describe('wearTimes', () => {
  it('adds up to the total, whatever the clocks', () => {
    const picture = {} as HTMLCanvasElement;
    const sent = {
      pictureId: 1,
      capturedMs: 1000,
      encodedMs: 1010,
      turn: 0 as const,
      size: WIDE,
      picture,
    };
    const ns = (ms: number): bigint => BigInt(ms) * 1_000_000n;
    const tracked: WearerTracked = create(WearerTrackedSchema, {
      receivedNs: ns(530),
      decodedNs: ns(535),
      trackedNs: ns(545),
    });
    const times = wearTimes(sent, tracked, 1065, 1070, -500);
    expect(times).toEqual({
      encode: 10,
      uplink: 20,
      decode: 5,
      track: 10,
      back: 20,
      draw: 5,
      total: 70,
    });
    const meter = new WearMeter(2);
    meter.add({ ...times, total: 900 });
    meter.add(times);
    meter.add({ ...times, total: 90 });
    expect(meter.percentile('total', 0)).toBe(70);
    expect(meter.percentile('total', 1)).toBe(90);
  });
});

describe('wearWords', () => {
  const fine = {
    link: { kind: 'live' },
    uplink: { kind: 'live' },
    camera: { kind: 'on' },
    paused: false,
    problem: '',
    untrackedMs: 50,
    tracking: { text: '● tracking good', warn: false },
    nowMs: 5000,
  } as const;
  it('says what matters most', () => {
    expect(wearWords(fine)).toEqual(fine.tracking);
    const reason = 'this invite was revoked';
    expect(wearWords({ ...fine, uplink: { kind: 'refused', reason } }).text).toBe(
      `refused: ${reason}`,
    );
    const lost = { kind: 'reconnecting', reason: 'no answer', sinceMs: 2000 } as const;
    expect(wearWords({ ...fine, uplink: lost }).text).toMatch(/reconnecting, 3 s: no answer/);
    expect(wearWords({ ...fine, paused: true }).warn).toBe(true);
    expect(wearWords({ ...fine, problem: 'pictures of 3x2 came' }).text).toMatch(/3x2/);
    expect(wearWords({ ...fine, untrackedMs: 2000 }).text).toMatch(/tracks nothing/);
  });
});

describe('statusWords', () => {
  const pose: Pose = {
    frameId: 1,
    status: 'tracking',
    quality: 'good',
    advice: '',
    metric: false,
    worldFromCamera: IDENTITY,
    attempted: 9,
    matched: 9,
    mapRevision: 1,
    markers: [],
  };
  it('does not say tracking while no picture comes', () => {
    const input = { link: { kind: 'live' }, pose, sourceEnded: false, nowMs: 10_000 } as const;
    expect(statusWords({ ...input, poseMs: 9000 }).text).toBe('tracking good');
    const away = statusWords({ ...input, poseMs: 6000 });
    expect(away).toMatchObject({ text: 'no picture for 4 s', warn: true });
    expect(away.advice).toMatch(/phone may be away/);
    expect(statusWords({ ...input, poseMs: 6000, paused: true }).text).toBe('picture paused');
    expect(statusWords({ ...input, poseMs: 6000, sourceEnded: true }).text).toBe('recording ended');
  });
});
