// Going to the firm's provider and coming back: what is kept for the way, and what is believed of it.
import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it } from 'vitest';
import { Access } from '../../src/transport/access';
import { beginSignIn, takeReturn } from '../../src/transport/sign_in';

class Memory {
  readonly kept = new Map<string, string>();
  getItem = (key: string): string | null => this.kept.get(key) ?? null;
  setItem = (key: string, value: string): void => void this.kept.set(key, value);
  removeItem = (key: string): void => void this.kept.delete(key);
}

class Door {
  readonly asked: { redirectUri: string; codeChallenge: string }[] = [];
  readonly finished: { state: string; code: string; codeVerifier: string }[] = [];
  readonly client = {
    getAccess: () => Promise.resolve({ waiting: false }),
    beginSignIn: (request: Door['asked'][number]) => {
      this.asked.push(request);
      return Promise.resolve({ url: 'https://login.firm.example/auth?x', state: 'S1' });
    },
    finishSignIn: (request: Door['finished'][number]) => {
      this.finished.push(request);
      return Promise.resolve({ token: 'pass' });
    },
  } as unknown as Access['client'];
}

const { signal } = new AbortController();
const origin = 'https://saccade.example:8443';

async function gone(door: Door, path = '/'): Promise<Memory> {
  const tab = new Memory();
  expect(await beginSignIn(door.client, origin, path, tab)).toBe(
    'https://login.firm.example/auth?x',
  );
  return tab;
}

describe('signing in', () => {
  it('tells the server the hash of what it keeps', async () => {
    const door = new Door();
    const tab = await gone(door);
    const back = takeReturn('?code=C&state=S1', tab);
    const bytes = new TextEncoder().encode(back?.codeVerifier);
    const hash = Buffer.from(await crypto.subtle.digest('SHA-256', bytes)).toString('base64url');
    expect(door.asked).toEqual([{ redirectUri: `${origin}/`, codeChallenge: hash }]);
    expect(back?.codeVerifier).toMatch(/^[\w-]{43}$/);
    expect(await gone(door).then((other) => [...other.kept.values()])).not.toEqual([
      ...tab.kept.values(),
    ]);
  });

  it('takes the code to the server once, and keeps the pass', async () => {
    const door = new Door();
    const tab = await gone(door);
    const back = takeReturn('?code=C&state=S1&iss=x', tab);
    const access = new Access('', undefined, tab, new Memory(), door.client, back);
    await access.enter(signal);
    await access.enter(signal); // after a lost connection
    expect(access.token).toBe('pass');
    expect(door.finished).toEqual([{ state: 'S1', code: 'C', codeVerifier: back?.codeVerifier }]);
    const reloaded = new Access('', undefined, tab, new Memory(), door.client);
    expect(reloaded.token).toBe('pass');
    expect(takeReturn('?code=C&state=S1', tab)?.problem).toMatch(/not begun in this tab/);
  });

  it('believes no code that it did not go for', async () => {
    const door = new Door();
    for (const [search, tab] of [
      ['?code=C&state=S2', await gone(door)],
      ['?code=C&state=S1', new Memory()],
    ] as const) {
      const back = takeReturn(search, tab);
      const access = new Access('', undefined, tab, new Memory(), door.client, back);
      const refused = await access.enter(signal).catch((error: unknown) => error);
      expect(ConnectError.from(refused).code).toBe(Code.Unauthenticated);
      expect(access.token).toBe('');
    }
    expect(door.finished).toEqual([]);
  });

  it('says what the provider says, in its own words only as far as they are a code', async () => {
    const back = takeReturn('?error=access_denied&state=S1', await gone(new Door()));
    expect(back?.problem).toBe('you were not signed in (access_denied)');
    const loud = takeReturn('?error=<b>CALL+0800</b>&state=S1', await gone(new Door()));
    expect(loud?.problem).toBe('you were not signed in (bb)');
  });

  it('goes back to the page that it came from, and to no other site', async () => {
    for (const [path, expected] of [
      ['/wear', '/wear'],
      ['/?name=Ada', '/?name=Ada'],
      ['//evil.example/', '/'],
      ['/\\evil.example', '/'],
    ] as const) {
      expect(takeReturn('?code=C&state=S1', await gone(new Door(), path))?.path).toBe(expected);
    }
  });

  it('leaves other addresses alone', () => {
    expect(takeReturn('', new Memory())).toBeUndefined();
    expect(takeReturn('?name=Ada', new Memory())).toBeUndefined();
    expect(takeReturn('?state=S1', new Memory())).toBeUndefined();
  });
});
