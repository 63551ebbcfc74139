// What a person's session and edits ask of the server, against a server that only notes it.
import { create } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it, vi } from 'vitest';
import {
  AnnotationSchema,
  type AnnotationTarget,
  CreateAnnotationResponseSchema,
} from '../../src/gen/saccade/v1/annotation_pb';
import { EventSchema, JoinResponseSchema } from '../../src/gen/saccade/v1/session_pb';
import { Edits, type Placement } from '../../src/session/edits';
import { cleanName, keepName, recallName } from '../../src/session/name';
import { Session } from '../../src/session/session';
import type { Clients } from '../../src/transport/clients';

describe('cleanName', () => {
  it('is one line of at most 60 bytes, cut between characters', () => {
    expect(cleanName('  Ada\n Lovelace\t')).toBe('Ada  Lovelace');
    expect(cleanName('ä'.repeat(40))).toBe('ä'.repeat(30));
    expect(cleanName('a' + '😀'.repeat(20))).toBe('a' + '😀'.repeat(14));
    expect(cleanName(' \u0007 ')).toBe('');
  });

  it('is recalled from the address, then from last time', () => {
    const kept = new Map<string, string>();
    const storage = {
      getItem: (key: string) => kept.get(key) ?? null,
      setItem: (key: string, value: string) => void kept.set(key, value),
    };
    expect(recallName('', storage)).toBe('expert');
    keepName('Grace', storage);
    expect(recallName('', storage)).toBe('Grace');
    expect(recallName('?name=Ada%20L', storage)).toBe('Ada L');
    expect(recallName('?name=%20', storage)).toBe('Grace');
  });
});

const pictures = { decode: () => undefined, reset: () => undefined, behind: false };
const options = { role: 'expert', view: 'raw', name: 'Ada' } as const;

describe('rename', () => {
  it('joins anew at once, under the new name, and does not say it was disconnected', async () => {
    const names: string[] = [];
    const links: string[] = [];
    // eslint-disable-next-line prefer-const -- the server below has to see it
    let session: Session;
    const clients = {
      session: {
        join: (request: { displayName: string }) => {
          names.push(request.displayName);
          links.push(session.link.kind);
          return Promise.resolve(create(JoinResponseSchema, { sessionId: `s${names.length}` }));
        },
        async *subscribe(_: unknown, { signal }: { signal: AbortSignal }) {
          yield create(EventSchema, { sequence: 1n });
          await new Promise((_resolve, reject) => {
            signal.addEventListener('abort', () => reject(new Error('cancelled')));
          });
        },
        ping: () => Promise.reject(new Error('not here')),
        acknowledge: () => Promise.resolve({}),
      },
      talk: { listMessages: () => Promise.resolve({ messages: [] }) },
    } as unknown as Clients;
    session = new Session(clients, options, pictures);
    const stop = new AbortController();
    const done = session.run(stop.signal);
    await vi.waitFor(() => expect(session.live).toBe(true));
    session.rename('Ada');
    session.rename('Grace');
    await vi.waitFor(() => expect(session.sessionId).toBe('s2'), { timeout: 200 });
    expect(names).toEqual(['Ada', 'Grace']);
    expect(links).toEqual(['connecting', 'connecting']);
    stop.abort();
    await done;
  });
});

describe('reset', () => {
  it('says whose session asks', async () => {
    const reset = vi.fn(() => Promise.resolve({}));
    const session = new Session({ map: { reset } } as unknown as Clients, options, pictures);
    session.joined = create(JoinResponseSchema, { sessionId: 's1' });
    await new Edits(session).resetMap();
    expect(reset).toHaveBeenCalledWith({ sessionId: 's1' }, expect.anything());
  });
});

describe('placing in a frozen picture', () => {
  const ray = {
    kind: 'ray',
    originInWorld: { x: 0, y: 0, z: 0 },
    directionInWorld: { x: 0, y: 0, z: 1 },
  } as const;
  const placement: Placement = {
    shape: 'cube',
    text: '',
    colorRgba: 0xff9a3dff,
    target: { kind: 'pixel', frameId: 7, pixel: { u: 3, v: 4 } },
    later: ray,
    guessInWorld: undefined,
  };
  const asked: AnnotationTarget['target']['case'][] = [];
  const editsThatMeet = (code: Code): Edits => {
    asked.length = 0;
    const clients = {
      annotations: {
        create: ({ draft }: { draft: { target?: AnnotationTarget } }) => {
          const kind = draft.target?.target.case;
          asked.push(kind);
          if (kind === 'framePixel') return Promise.reject(new ConnectError('gone', code));
          const annotation = create(AnnotationSchema, { id: 'a' });
          return Promise.resolve(create(CreateAnnotationResponseSchema, { annotation }));
        },
      },
    } as unknown as Clients;
    return new Edits(new Session(clients, options, pictures));
  };

  it('takes the ray once the server no longer keeps the frame', async () => {
    const placed = await editsThatMeet(Code.NotFound).place(placement);
    expect(placed.id).toBe('a');
    expect(asked).toEqual(['framePixel', 'ray']);
  });

  it('does not where there is none, nor for any other refusal', async () => {
    const edits = editsThatMeet(Code.NotFound);
    await expect(edits.place({ ...placement, later: undefined })).rejects.toThrow('gone');
    const refused = editsThatMeet(Code.ResourceExhausted);
    await expect(refused.place(placement)).rejects.toThrow('gone');
    expect(asked).toEqual(['framePixel']);
  });
});
