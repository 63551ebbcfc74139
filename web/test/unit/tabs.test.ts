// Tabs of one browser, and the session that a tab keeps: against a server that only notes what is asked.
import { create } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { afterEach, describe, expect, it, vi } from 'vitest';
import { EventSchema, JoinResponseSchema } from '../../src/gen/saccade/v1/session_pb';
import { KeptSession } from '../../src/session/kept_session';
import { Session } from '../../src/session/session';
import type { SessionOptions } from '../../src/session/session_options';
import { silenceWords } from '../../src/session/silence';
import { MAX_STREAMS, Tabs } from '../../src/session/tabs';
import type { Clients } from '../../src/transport/clients';
import { plainWords, streamEndWords } from '../../src/transport/errors';

const channels: BroadcastChannel[] = [];
afterEach(() => channels.splice(0).forEach((channel) => channel.close()));
let room = 0;

const openTab = (sinceMs: number, name = `room ${room}`): Tabs => {
  const channel = new BroadcastChannel(name);
  channels.push(channel);
  return new Tabs(
    channel as unknown as ConstructorParameters<typeof Tabs>[0],
    `t${sinceMs}`,
    sinceMs,
  );
};

describe('Tabs', () => {
  it('lets the older ones go first, also when all begin at once', async () => {
    ++room;
    const { signal } = new AbortController();
    const tabs = [3, 1, 5, 2, 6, 4].map((since) => openTab(since));
    await Promise.all(tabs.map((tab) => tab.ask(signal)));
    expect(tabs.map((tab) => tab.mayStream)).toEqual([true, true, false, true, false, true]);
    expect(tabs.map((tab) => tab.older)).toEqual([2, 0, 4, 1, 5, 3]);
  });

  it('waits for its turn, says so, and goes on when one has gone', async () => {
    ++room;
    const stop = new AbortController();
    const older = Array.from({ length: MAX_STREAMS }, (_, i) => openTab(i));
    const late = openTab(100);
    await late.ask(stop.signal);
    const told: number[] = [];
    let turn = false;
    const done = late.turn(stop.signal, (n) => told.push(n)).then(() => (turn = true));
    await new Promise((resolve) => setTimeout(resolve, 50));
    expect([told, turn]).toEqual([[MAX_STREAMS], false]);
    older[2]!.leave();
    channels[2]!.close();
    await done;
    expect(late.older).toBe(MAX_STREAMS - 1);
  });

  it('waits for a busy one, where it has to be sure', async () => {
    ++room;
    const { signal } = new AbortController();
    const busy = new BroadcastChannel(`room ${room}`);
    channels.push(busy);
    const here = { kind: 'here', id: 'busy', sinceMs: 0, sessionId: 's1' };
    busy.onmessage = () => setTimeout(() => busy.postMessage(here), 500);
    const tab = openTab(5);
    await tab.ask(signal);
    expect(tab.uses('s1')).toBe(false);
    await tab.ask(signal, true);
    expect(tab.uses('s1')).toBe(true);
  });

  it('knows that another tab goes on with a session', async () => {
    ++room;
    const { signal } = new AbortController();
    const [first, second] = [openTab(1), openTab(2)];
    first.use('s1');
    await second.ask(signal);
    expect([second.uses('s1'), second.uses('s2'), first.uses('s1')]).toEqual([true, false, false]);
  });
});

describe('a session', () => {
  const pictures = { decode: () => undefined, reset: () => undefined, behind: false };
  const memory = () => {
    const kept = new Map<string, string>();
    return {
      getItem: (key: string) => kept.get(key) ?? null,
      setItem: (key: string, value: string) => void kept.set(key, value),
      removeItem: (key: string) => void kept.delete(key),
    };
  };

  /** A server that knows sessions; `end` ends the stream of the newest subscription. */
  const server = () => {
    const asked: string[] = [];
    const known = new Set<string>();
    let end: (error: Error) => void = () => undefined;
    const clients = {
      session: {
        join: ({ resumeSessionId = '' }: { resumeSessionId?: string }) => {
          asked.push(resumeSessionId);
          const sessionId = known.has(resumeSessionId) ? resumeSessionId : `s${known.size + 1}`;
          known.add(sessionId);
          return Promise.resolve(create(JoinResponseSchema, { sessionId, participantId: 'p' }));
        },
        async *subscribe(_: unknown, { signal }: { signal: AbortSignal }) {
          yield create(EventSchema, { sequence: 1n });
          await new Promise((_resolve, reject) => {
            end = reject;
            signal.addEventListener('abort', () => reject(new Error('cancelled')));
          });
        },
        ping: () => Promise.reject(new Error('not here')),
        acknowledge: () => Promise.resolve({}),
      },
      talk: { listMessages: () => Promise.resolve({ messages: [] }) },
    } as unknown as Clients;
    return { clients, asked, end: (error: Error) => end(error) };
  };

  const run = async (clients: Clients, options: Partial<SessionOptions>) => {
    const session = new Session(
      clients,
      { role: 'expert', view: 'raw', name: 'Ada', ...options },
      pictures,
    );
    const stop = new AbortController();
    const done = session.run(stop.signal);
    await vi.waitFor(() => expect(session.live).toBe(true), { timeout: 3000 });
    const leave = async () => {
      stop.abort();
      await done;
    };
    return { session, leave };
  };

  it('is gone on with after a reload, by who has the same name', async () => {
    const { clients, asked } = server();
    const storage = memory();
    const first = await run(clients, { kept: new KeptSession(storage, 'expert') });
    await first.leave();
    const again = await run(clients, { kept: new KeptSession(storage, 'expert') });
    expect(again.session.sessionId).toBe(first.session.sessionId);
    await again.leave();
    const wearer = await run(clients, { role: 'wearer', kept: new KeptSession(storage, 'wearer') });
    await wearer.leave();
    const other = await run(clients, { name: 'Grace', kept: new KeptSession(storage, 'expert') });
    await other.leave();
    expect(asked).toEqual(['', 's1', '', '']);
  });

  it('is gone on with after the network was away', async () => {
    const { clients, asked, end } = server();
    const { session, leave } = await run(clients, {});
    end(new ConnectError('fetch failed', Code.Unavailable));
    await vi.waitFor(() => expect(session.link.kind).toBe('reconnecting'));
    await vi.waitFor(() => expect(session.live).toBe(true));
    expect(asked).toEqual(['', 's1']);
    await leave();
  });

  it('is left to the tab that has taken it: no fight', async () => {
    const { clients, asked, end } = server();
    const storage = memory();
    const { session, leave } = await run(clients, { kept: new KeptSession(storage, 'expert') });
    const text = 'session_id: this session opened another stream';
    end(new ConnectError(text, Code.Aborted));
    await vi.waitFor(() => expect(session.link.kind).toBe('reconnecting'));
    expect(session.link).toMatchObject({ reason: 'this session goes on in another tab' });
    await vi.waitFor(() => expect(session.sessionId).toBe('s2'));
    await leave();
    expect(asked).toEqual(['', '']);
    expect(new KeptSession(storage, 'expert').recall('Ada')).toBe('s2');
  });

  it('is not shared with a duplicate of the tab that still has it', async () => {
    ++room;
    const { clients, asked } = server();
    const storage = memory();
    const kept = () => new KeptSession(storage, 'expert', true);
    const first = await run(clients, { kept: kept(), tabs: openTab(1) });
    const second = await run(clients, { kept: kept(), tabs: openTab(2) });
    expect([first.session.sessionId, second.session.sessionId]).toEqual(['s1', 's2']);
    expect(asked).toEqual(['', 's1', '']);
    await first.leave();
    await second.leave();
  });
});

describe('what went wrong', () => {
  const say = (message: string, code = Code.InvalidArgument) =>
    plainWords(new ConnectError(message, code));

  it('names no field of a request', () => {
    const messages = [
      'draft.target.frame_pixel.pixel.u: -7 is outside the picture',
      'target.frame_pixel.pixel (700.0, 1.0) is outside the picture, which is 640 x 480; click inside it',
      'text: at most 500 bytes, not 612',
      'draft.ink_px[3].v: is not a finite number',
      'size_m is 20; give more than 0 and at most 10 m',
      'session_id: unknown to this server: call Join again',
      'target.feature_id 7 is not in the map (any more); choose a feature of the newest map',
      'frame 7 is no longer kept: frames are kept for 10 s and the oldest is 9; click on a newer picture',
    ];
    for (const message of messages) expect(say(message)).not.toMatch(/[a-z]_[a-z]|\w\.\w+\.\w|\]:/);
    expect(say(messages[0]!)).toBe('that is outside the picture: click inside it');
    expect(say(messages[2]!)).toBe('the text has 612 bytes, and at most 500 are kept: shorten it');
  });

  it('leaves plain words alone', () => {
    const text = 'the map has no depth for any feature in that view yet; move the camera sideways';
    expect(say(text)).toBe(text);
    expect(say('this session has nothing to undo')).toBe('you have nothing to undo');
  });

  it('says why a stream ended, and for how long nothing was heard', () => {
    const ended = new ConnectError('nothing acknowledged for 30 s', Code.DeadlineExceeded);
    expect(streamEndWords(ended)).toBe('the server heard nothing from this page for too long');
    const late = new ConnectError('the operation timed out', Code.DeadlineExceeded);
    expect(streamEndWords(late)).toBe('the server did not answer in time');
    expect(silenceWords(4300, 510)).toBe('no data for 4 s');
    expect(silenceWords(2 * 3_600_000, 2 * 3_600_000)).toBe('no data for 2 h: this computer slept');
  });
});
