import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it } from 'vitest';
import { RecordingWatch } from '../../src/session/recording';
import type { Session } from '../../src/session/session';
import { durationWords } from '../../src/ui/record_control';
import { presenceWords } from '../../src/ui/words';

const recorder = { participantId: 'recording', role: 'viewer' as const };
const ann = { participantId: 'a1', role: 'expert' as const };
const namesake = { participantId: 'b2', role: 'viewer' as const, name: 'recording' };

const on = { on: true, file: 'x.mcap', sinceUnixNs: 5_000_000_000n, bytes: 9n, problem: '' };
const off = { ...on, on: false };

/** A server that records, or refuses to. */
function make(refuses = false): { session: Session; watch: RecordingWatch; asked: string[] } {
  const asked: string[] = [];
  let state = off;
  const answer = (call: string, next: typeof on) => () => {
    asked.push(call);
    if (refuses && call !== 'get')
      return Promise.reject(new ConnectError('not yours', Code.PermissionDenied));
    state = next;
    return Promise.resolve({ recording: state });
  };
  const recording = {
    getRecording: () => answer('get', state)(),
    startRecording: answer('start', on),
    stopRecording: answer('stop', off),
  };
  const session = { live: true, sessionId: 's', participants: [ann], clients: { recording } };
  const made = session as unknown as Session;
  return { session: made, watch: new RecordingWatch(made), asked };
}
const settle = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));

describe('a recording', () => {
  it('is told of by the recorder alone, not by one of its name', () => {
    expect(presenceWords([ann, recorder])).toBe('1 expert, recorded');
    expect(presenceWords([ann, namesake])).toBe('1 expert, 1 viewer');
  });

  it('is asked for at first, when the recorder comes and goes, and at times while it is on', async () => {
    const { session, watch, asked } = make();
    watch.update(0);
    await settle();
    watch.update(60_000);
    expect(asked).toEqual(['get']);
    await watch.toggle();
    expect(watch.on).toBe(true);
    expect(watch.state?.sinceMs).toBe(5000);
    session.participants = [ann, recorder] as unknown as Session['participants'];
    watch.update(61_000);
    await settle();
    watch.update(62_000);
    watch.update(66_500);
    await settle();
    expect(asked).toEqual(['get', 'start', 'get', 'get']);
    await watch.toggle();
    expect(asked.at(-1)).toBe('stop');
    expect(watch.on).toBe(false);
  });

  it('that may not be begun says why', async () => {
    const { watch } = make(true);
    await watch.toggle();
    expect(watch.on).toBe(false);
    expect(watch.failure).toMatch(/not yours/);
  });

  it('has its length in words', () => {
    expect([7_900, 724_000, 3_753_000].map(durationWords)).toEqual(['0:07', '12:04', '1:02:33']);
  });
});
