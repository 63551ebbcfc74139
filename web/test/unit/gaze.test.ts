// Piloting the head: the lease and its heartbeats, against a server that only notes what is asked;
// what is said and drawn of it.
import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it, vi } from 'vitest';
import {
  type AcquireLeaseResponse,
  AcquireLeaseResponseSchema,
  GazeMode,
  GazeStateSchema,
} from '../../src/gen/saccade/v1/gaze_pb';
import { JoinResponseSchema } from '../../src/gen/saccade/v1/session_pb';
import { Camera } from '../../src/geometry/camera';
import { IDENTITY } from '../../src/geometry/rigid3';
import { makeView } from '../../src/geometry/view';
import { sightInPicture } from '../../src/scene/gaze_sight';
import type { Gaze } from '../../src/session/gaze';
import type { Annotation } from '../../src/session/types';
import { toGaze } from '../../src/session/gaze_convert';
import { GazePilot } from '../../src/session/gaze_pilot';
import { Session } from '../../src/session/session';
import type { Clients } from '../../src/transport/clients';
import { LeaseLoop, type LeaseTold } from '../../src/transport/lease_loop';
import {
  gazeWords,
  handoverWords,
  ordinal,
  sideOf,
  steerWords,
  targetWords,
} from '../../src/ui/gaze_words';

const granted = (leaseId: string) => create(AcquireLeaseResponseSchema, { granted: true, leaseId });
const queued = (queuePosition: number) =>
  create(AcquireLeaseResponseSchema, { queuePosition, pilot: { displayName: 'Ann' } });
const settle = () => new Promise((resolve) => setTimeout(resolve, 0));

describe('LeaseLoop', () => {
  const start = () => {
    const asked: string[] = [];
    const answers: ((answer: AcquireLeaseResponse | Error) => void)[] = [];
    const told: LeaseTold[] = [];
    const acquire = (_session: string, lease: string) => {
      asked.push(lease);
      return new Promise<AcquireLeaseResponse>((resolve, reject) => {
        answers.push((answer) => (answer instanceof Error ? reject(answer) : resolve(answer)));
      });
    };
    const loop = new LeaseLoop(acquire, 's1', (one) => told.push(one), 0);
    return { loop, asked, answers, told };
  };

  /** One that was granted the lease L. */
  const held = async () => {
    const all = start();
    all.loop.beat(0);
    all.answers[0]?.(granted('L'));
    await settle();
    all.asked.length = all.answers.length = all.told.length = 0;
    return all;
  };

  it('goes on while answers are late, but not without end', async () => {
    const { loop, asked } = await held();
    for (let t = 150; t <= 900; t += 150) loop.beat(t);
    expect(asked).toEqual(['L', 'L', 'L']);
  });

  it('asks once at a time while it waits, and renews what it is granted', async () => {
    const { loop, asked, answers, told } = start();
    loop.beat(150);
    loop.beat(300);
    expect(asked).toEqual(['']);
    answers[0]?.(queued(1));
    await settle();
    loop.beat(450);
    answers[1]?.(granted('L'));
    await settle();
    loop.beat(600);
    expect(asked).toEqual(['', '', 'L']);
    expect(told.map((one) => one.kind === 'answer' && one.granted)).toEqual([false, true]);
  });

  it('pauses when the page hangs, and goes on with it', async () => {
    const { loop, asked } = await held();
    loop.beat(2100);
    expect(asked).toEqual([]);
    loop.alive(2200);
    loop.beat(2250);
    expect(asked).toEqual(['L']);
  });

  it('passes over a lost heartbeat; ends when the lease has', async () => {
    const { loop, asked, answers, told } = await held();
    loop.beat(150);
    answers[0]?.(new ConnectError('fetch failed', Code.Unavailable));
    await settle();
    loop.beat(300);
    answers[1]?.(new ConnectError('lease_id: is no longer in force', Code.FailedPrecondition));
    await settle();
    loop.beat(450);
    expect(asked).toHaveLength(2);
    expect(told).toEqual([{ kind: 'refused', reason: 'the lease has ended' }]);
  });

  it('says why it was never granted, and that the server knows the session no longer', async () => {
    const never = start();
    never.loop.beat(150);
    const why = 'session_id: viewers change nothing';
    never.answers[0]?.(new ConnectError(why, Code.PermissionDenied));
    await settle();
    expect(never.told).toEqual([{ kind: 'refused', reason: 'viewers change nothing' }]);
    const { loop, answers, told } = await held();
    loop.beat(150);
    answers[0]?.(new ConnectError('session_id: unknown: call Join again', Code.NotFound));
    await settle();
    expect(told).toEqual([{ kind: 'refused', reason: 'the connection was lost' }]);
  });

  it('sends nothing more once ended, and says when nothing is under way', async () => {
    const { loop, asked, answers, told } = start();
    loop.beat(150);
    expect(loop.end()).toBe(false);
    answers[0]?.(granted('L'));
    await settle();
    expect(loop.end()).toBe(true);
    loop.beat(300);
    expect(asked).toHaveLength(1);
    expect(told).toEqual([]);
  });
});

describe('GazePilot', () => {
  const mine = {
    kind: 'answer',
    granted: true,
    leaseId: 'L',
    queuePosition: 0,
    pilot: 'Ann',
  } as const;
  const inQueue = { ...mine, granted: false, leaseId: '', queuePosition: 2 } as const;
  const pictures = { decode: () => undefined, reset: () => undefined, behind: false };
  const begin = (answer: LeaseTold | undefined) => {
    const calls: string[] = [];
    const note = (name: string) => () => {
      calls.push(name);
      return Promise.resolve({});
    };
    const state = create(GazeStateSchema, { lastHandover: 'the wearer took over from Ann' });
    const gaze = {
      releaseLease: note('release'),
      stopFixating: note('stop'),
      fixate: note('fixate'),
      getState: () => Promise.resolve({ state }),
    };
    const clients = { gaze } as unknown as Clients;
    const session = new Session(clients, { role: 'expert', view: 'raw', name: 'Ann' }, pictures);
    session.joined = create(JoinResponseSchema, { sessionId: 's1', participantId: 's1' });
    let tell: (told: LeaseTold) => void = () => undefined;
    const keep = (_session: string, told: (told: LeaseTold) => void) => {
      calls.push('keep');
      tell = told;
      if (answer) setTimeout(() => told(answer), 0);
      return { stop: () => Promise.resolve(void calls.push('keep no more')) };
    };
    const pilot = new GazePilot(session, { warm: () => undefined, keep });
    return { pilot, session, calls, state, tell: (told: LeaseTold) => tell(told) };
  };

  it('keeps what it was granted until it releases', async () => {
    const { pilot, calls } = begin(mine);
    expect(await pilot.acquire()).toBe(true);
    expect(await pilot.acquire()).toBe(true);
    await pilot.release();
    expect(calls).toEqual(['keep', 'keep no more', 'release']);
    expect(pilot.lease.kind).toBe('none');
  });

  it('says why it was refused, or that nobody answers', async () => {
    const refused = begin({ kind: 'refused', reason: 'viewers change nothing' });
    await expect(refused.pilot.acquire()).rejects.toThrow('viewers change nothing');
    expect(refused.calls).toEqual(['keep', 'keep no more']);
    vi.useFakeTimers();
    const silent = begin(undefined);
    const acquired = silent.pilot.acquire().catch(String);
    await vi.advanceTimersByTimeAsync(4000);
    vi.useRealTimers();
    expect(await acquired).toContain('the server did not answer in time');
    expect(silent.calls).toEqual(['keep', 'keep no more']);
  });

  it('waits its turn', async () => {
    const { pilot, calls, tell } = begin(inQueue);
    expect(await pilot.acquire()).toBe(false);
    expect(pilot.lease).toEqual({ kind: 'waiting', position: 2, pilot: 'Ann' });
    tell({ ...mine, pilot: 'Bob' });
    expect(pilot.holds).toBe(true);
    expect(calls).toEqual(['keep']);
  });

  it('stops its heartbeats when the lease is gone, and says who has it', async () => {
    const { pilot, calls, state, tell } = begin(mine);
    await pilot.acquire();
    tell({ kind: 'refused', reason: 'the lease has ended' });
    await settle();
    expect(pilot.lease.kind).toBe('none');
    expect(pilot.lost).toBe('You pilot no longer: the wearer took over from Ann.');
    state.lastHandover = 'Ann vanished; nobody pilots';
    await pilot.acquire();
    tell({ kind: 'refused', reason: 'the lease has ended' });
    await settle();
    expect(pilot.lost).toBe('You pilot no longer: this page was not heard in time; nobody pilots.');
    expect(calls.at(-1)).toBe('keep no more');
  });

  it('waits on where the wearer took it from us', async () => {
    const { pilot, calls, state, tell } = begin(mine);
    await pilot.acquire();
    const names = {
      pilot: { participantId: 'w', displayName: 'wearer' },
      queue: [{ participantId: 's1' }],
    };
    Object.assign(state, create(GazeStateSchema, names));
    tell({ kind: 'refused', reason: 'the lease has ended' });
    await settle();
    expect(calls).toEqual(['keep', 'keep no more', 'keep']);
    tell({ ...inQueue, queuePosition: 1, pilot: 'wearer' });
    expect(pilot.lease).toEqual({ kind: 'waiting', position: 1, pilot: 'wearer' });
    expect(pilot.lost).toBe('');
  });

  it('tells nobody of herself by name: somebody else waited', async () => {
    const { pilot, state, tell } = begin(mine);
    await pilot.acquire();
    Object.assign(
      state,
      create(GazeStateSchema, {
        pilot: { participantId: 'b', displayName: 'Bob' },
        lastHandover: 'Ann vanished; Bob pilots',
      }),
    );
    tell({ kind: 'refused', reason: 'the lease has ended' });
    await vi.waitFor(() => expect(pilot.lost).toContain('heard'));
    expect(pilot.lost).toBe('You pilot no longer: this page was not heard in time; Bob pilots.');
    await pilot.release();
  });

  it('drops the lease of a session that is over', async () => {
    const { pilot, session, calls } = begin(mine);
    await pilot.acquire();
    pilot.check();
    expect(pilot.holds).toBe(true);
    session.joined = create(JoinResponseSchema, { sessionId: 's2', participantId: 's2' });
    pilot.check();
    expect(pilot.lease.kind).toBe('none');
    expect(calls.slice(-2)).toEqual(['keep no more', 'release']);
  });

  it('stops a head that nobody pilots, and does not keep it', async () => {
    const { pilot, session, calls } = begin(mine);
    await pilot.stop();
    expect(calls).toEqual(['keep', 'stop', 'keep no more', 'release']);
    session.gaze = toGaze(
      create(GazeStateSchema, { pilot: { participantId: 's9', displayName: 'Bob' } }),
    );
    await expect(pilot.stop()).rejects.toThrow('only Bob or the wearer can stop it');
  });

  it('says a refusal without the name of a field', async () => {
    const { pilot, session } = begin(mine);
    const refuse = vi.fn(() =>
      Promise.reject(new ConnectError('target.feature_id: 7 is not in the map', Code.NotFound)),
    );
    Object.assign(session.clients.gaze, { fixate: refuse });
    const looked = pilot.fixate({ kind: 'feature', featureId: 7 }, true);
    await expect(looked).rejects.toThrow(/^that feature is no longer in the map: click again$/);
    expect(refuse).toHaveBeenCalledWith(
      { sessionId: 's1', target: { target: { case: 'featureId', value: 7n } }, fast: true },
      expect.anything(),
    );
  });
});

const DEGREE = Math.PI / 180;
type Fields = Exclude<MessageInitShape<typeof GazeStateSchema>, { $typeName: string }>;
const gazeOf = (fields: Fields): Gaze =>
  toGaze(create(GazeStateSchema, { panRad: 0, elevationRad: 0, ...fields }));
const point = {
  target: { case: 'pointInWorldM', value: { $typeName: 'saccade.v1.Vector3', x: 0, y: 0, z: 1 } },
} as const;

describe('words of the gaze', () => {
  const say = (fields: Fields) =>
    gazeWords({ gaze: gazeOf({ target: point, ...fields }), annotation: undefined });

  it('give a saccade its way to go, and what is held its error', () => {
    expect(say({ mode: GazeMode.SACCADE, errorRad: 12.34 * DEGREE })).toMatchObject({
      text: 'turning to a point',
      number: '12.3 deg to go',
      warn: false,
    });
    const held = say({ mode: GazeMode.FIXATE, arrived: true, errorRad: 0.6 * DEGREE });
    expect(held).toMatchObject({ text: 'holding a point', number: '0.6 deg', mark: '●' });
  });

  it('say what to do about a target out of reach, and that one is lost', () => {
    const far = say({
      mode: GazeMode.FIXATE,
      unreachable: true,
      missRad: 23 * DEGREE,
      panRad: 170 * DEGREE,
      guidanceRad: Math.PI,
    });
    expect(far.advice).toContain(
      'misses it by 23.0 deg: this is as near as it can look (170 deg right)',
    );
    expect(far.advice).toContain('turn left');
    expect(say({ mode: GazeMode.FIXATE, targetLost: true }).advice).toContain('Target lost');
    expect(say({ mode: GazeMode.STOPPED, problem: 'the mount is silent' })).toMatchObject({
      text: 'stopped',
      advice: 'the mount is silent',
      warn: true,
    });
  });

  it('name sides clockwise from the right', () => {
    expect([0, 90, 180, -90, 271, 44].map((angle) => sideOf(angle * DEGREE))).toEqual([
      'right',
      'down',
      'left',
      'up',
      'up',
      'right and down',
    ]);
    expect([1, 2, 3, 4, 11, 12, 13, 21, 112].map(ordinal).join(' ')).toBe(
      '1st 2nd 3rd 4th 11th 12th 13th 21st 112th',
    );
  });

  it('say who pilots and who waits', () => {
    const ann = { participantId: 'a', displayName: 'Ann' };
    const bob = { participantId: 'b', displayName: 'Bob' };
    const gaze = gazeOf({ pilot: ann, queue: [bob], lastHandover: 'Bob released; Ann pilots' });
    const person = { personId: '', colorRgba: 0 };
    const participants = [{ ...person, participantId: 'a', name: 'Ann', role: 'wearer' }] as const;
    const lease = { kind: 'none' } as const;
    const say = (me: string, present: readonly (typeof participants)[number][] = []) =>
      steerWords({ gaze, lease, me, participants: present });
    expect(say('a')).toBe('you pilot · Bob waits');
    expect(say('b')).toBe('Ann pilots · you are 1st in the queue');
    expect(say('c', participants)).toBe('the wearer has taken over · Bob waits');
    expect(handoverWords(gaze, 'c')).toBe('Camera: Bob released; Ann pilots.');
    expect(handoverWords(gaze, 'a')).toBe('You pilot the camera now: Bob released; Ann pilots.');
    const late = gazeOf({ pilot: bob, lastHandover: 'Ann vanished; Bob pilots' });
    expect(handoverWords(late, 'c')).toBe('Camera: Ann vanished; Bob pilots.');
    expect(handoverWords(late, 'a', 'Ann')).toBe(
      'Camera: this page was not heard in time; Bob pilots.',
    );
  });

  it('have an article that fits', () => {
    const target = { target: { case: 'annotationId', value: 'm' } } as const;
    const gaze = gazeOf({ mode: GazeMode.SACCADE, target });
    const word = (shape: 'cube' | 'note' | 'arrow' | 'ink') =>
      targetWords({ gaze, annotation: { shape, text: '' } as Annotation });
    expect((['cube', 'note', 'arrow', 'ink'] as const).map(word)).toEqual([
      'a cube',
      'a note',
      'an arrow',
      'a stroke',
    ]);
  });
});

describe('the target in the picture', () => {
  const size = { width: 640, height: 480, fx: 500, fy: 500, cx: 319.5, cy: 239.5 };
  const view = makeView(new Camera({ model: 'pinhole', ...size, distortion: [] }), IDENTITY);
  const at = (x: number, y: number, z: number, guidanceRad?: number) =>
    sightInPicture(view, {
      ...gazeOf({ mode: GazeMode.SACCADE }),
      targetInWorld: { x, y, z },
      guidanceRad,
    });

  it('is marked where it appears', () => {
    expect(at(0.2, 0, 1)).toEqual({ at: { u: 419.5, v: 239.5 }, arrow: undefined });
  });

  it('is pointed to where it does not, also behind', () => {
    expect(at(3, 0, 1)?.arrow?.direction).toEqual({ u: 1, v: 0 });
    expect(at(-3, 0, -1)?.arrow?.direction).toEqual({ u: -1, v: 0 });
    expect(at(-3, 0, -1)?.at).toBeUndefined();
  });

  it('beyond the joints is pointed to as the server says', () => {
    expect(at(3, 0, 1, Math.PI / 2)?.arrow?.direction.v).toBeCloseTo(1, 9);
  });
});
