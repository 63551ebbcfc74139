// What lets a browser in: the invite of a link, the pass it is redeemed for, and what is kept of both.
import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it, vi } from 'vitest';
import { Access, inviteOf } from '../../src/transport/access';
import { isRefusal, plainWords, streamEndWords } from '../../src/transport/errors';

class Memory {
  readonly kept = new Map<string, string>();
  getItem = (key: string): string | null => this.kept.get(key) ?? null;
  setItem = (key: string, value: string): void => void this.kept.set(key, value);
  removeItem = (key: string): void => void this.kept.delete(key);
}

/** A server that redeems each invite once. */
class Door {
  readonly redeemed: string[] = [];
  readonly names: string[] = [];
  waits = 0; // so often one is told to wait
  refusal = '';
  readonly client = {
    getAccess: () => Promise.resolve({ waiting: this.waits-- > 0, refusal: this.refusal }),
    redeem: ({ invite, displayName }: { invite: string; displayName: string }) => {
      this.names.push(displayName);
      if (this.redeemed.includes(invite)) {
        const words = 'access: this invite has been used up; ask for a new one';
        return Promise.reject(new ConnectError(words, Code.Unauthenticated));
      }
      this.redeemed.push(invite);
      return Promise.resolve({ token: `pass of ${invite}` });
    },
  } as unknown as Access['client'];
}

const { signal } = new AbortController();
const open = (door: Door, invite: string | undefined, tab: Memory, browser: Memory): Access =>
  new Access('', invite, tab, browser, door.client);

describe('Access', () => {
  it('takes the invite of a link from its fragment alone', () => {
    expect(inviteOf('#invite=iab.SECRET')).toBe('iab.SECRET');
    expect(inviteOf('')).toBeUndefined();
    expect(inviteOf('#other')).toBeUndefined();
  });

  it('redeems an invite once, however often its link is opened in this browser', async () => {
    const [door, tab, browser] = [new Door(), new Memory(), new Memory()];
    const first = open(door, 'i1.secret', tab, browser);
    await first.enter(signal);
    await first.enter(signal); // after a lost connection
    expect(first.token).toBe('pass of i1.secret');
    const reloaded = open(door, undefined, tab, browser);
    const again = open(door, 'i1.secret', new Memory(), browser);
    for (const access of [reloaded, again]) {
      await access.enter(signal);
      expect(access.token).toBe('pass of i1.secret');
    }
    expect(door.redeemed).toEqual(['i1.secret']);
  });

  it('waits until somebody lets one in, under the name that they see', async () => {
    vi.useFakeTimers();
    const door = new Door();
    door.waits = 3;
    const access = open(door, 'i1.secret', new Memory(), new Memory());
    let told = 0;
    const entered = access.enter(signal, 'Ada', () => ++told);
    await vi.advanceTimersByTimeAsync(2500);
    expect(told).toBe(3);
    await vi.advanceTimersByTimeAsync(1000);
    await entered;
    expect(door.names).toEqual(['Ada']);
    vi.useRealTimers();
  });

  it('stops to wait when the page is left', async () => {
    const door = new Door();
    door.waits = 1000;
    const leaving = new AbortController();
    const access = open(door, 'i1.secret', new Memory(), new Memory());
    const entered = access.enter(leaving.signal, 'Ada', () => leaving.abort());
    await expect(entered).rejects.toThrow();
  });

  it('keeps the secret of no invite', async () => {
    const [door, tab, browser] = [new Door(), new Memory(), new Memory()];
    door.client.redeem = () => Promise.resolve({ token: 'p.x' }) as never;
    await open(door, 'i1.secret', tab, browser).enter(signal);
    for (const { kept } of [tab, browser])
      expect([...kept.values()].join()).not.toContain('secret');
  });

  it('means the link that was opened last, and each tab its own', async () => {
    const [door, browser, one, two] = [new Door(), new Memory(), new Memory(), new Memory()];
    await open(door, 'i1.a', one, browser).enter(signal);
    await open(door, 'i2.b', two, browser).enter(signal);
    expect(open(door, undefined, one, browser).token).toBe('pass of i1.a');
    expect(open(door, undefined, new Memory(), browser).token).toBe('pass of i2.b');
  });

  it('does not go on with an old pass where a new invite is refused', async () => {
    const [door, tab, browser] = [new Door(), new Memory(), new Memory()];
    await open(door, 'i1.a', tab, browser).enter(signal);
    door.redeemed.push('i2.b');
    const access = open(door, 'i2.b', tab, browser);
    await expect(access.enter(signal)).rejects.toThrow('used up');
    expect(access.token).toBe('');
  });
});

describe('refusals', () => {
  const refusal = (message: string): ConnectError =>
    new ConnectError(message, Code.Unauthenticated);

  it('end the attempts, and are words for a person', () => {
    const expired = refusal('access: this invite has expired; ask for a new one');
    expect(isRefusal(expired)).toBe(true);
    expect(streamEndWords(expired)).toBe('this invite has expired; ask for a new one');
    expect(
      plainWords(
        refusal('access: this server lets in who has an invite; ask for a link and open it'),
      ),
    ).toBe('you need an invite: ask for a link, and open it');
    const role =
      'access: this takes the role annotator, and yours is viewer; ask for another invite';
    expect(plainWords(new ConnectError(role, Code.PermissionDenied))).toBe(
      'your invite is for a viewer, and this takes the role annotator: ask for another invite',
    );
  });
});
