import type { Client } from '@connectrpc/connect';
import type { AccessService } from '../gen/saccade/v1/access_pb';

type TabStorage = Pick<Storage, 'getItem' | 'setItem' | 'removeItem'>;

/** What came back from the firm's provider, with what this tab kept of having gone there. */
export interface Return {
  readonly state: string;
  readonly code: string;
  readonly codeVerifier: string;
  /** Where the page was that went: another one of ours than the one it comes back to. */
  readonly path: string;
  /** Why there is nothing to be had; empty: there is. */
  readonly problem: string;
}

interface Kept {
  readonly state: string;
  readonly codeVerifier: string;
  readonly path: string;
}

const KEY = 'saccade.signin';
const VERIFIER_BYTES = 32;
const NOT_OURS = 'this sign-in was not begun in this tab; sign in again';

/** Where the provider sends people back to; whoever registers the page there names it. */
export const redirectUri = (origin: string): string => `${origin}/`;

/**
 * Asks for the address at which one signs in, and keeps for this tab what the way back needs. Rejects as
 * BeginSignIn does.
 */
export async function beginSignIn(
  client: Pick<Client<typeof AccessService>, 'beginSignIn'>,
  origin: string,
  path: string,
  tab: TabStorage,
): Promise<string> {
  const codeVerifier = base64url(crypto.getRandomValues(new Uint8Array(VERIFIER_BYTES)));
  const digest = await crypto.subtle.digest('SHA-256', new TextEncoder().encode(codeVerifier));
  const request = {
    redirectUri: redirectUri(origin),
    codeChallenge: base64url(new Uint8Array(digest)),
  };
  const { url, state } = await client.beginSignIn(request, { timeoutMs: 15_000 });
  const kept: Kept = { state, codeVerifier, path };
  tab.setItem(KEY, JSON.stringify(kept));
  return url;
}

/** What the address of a page says that the provider sent back; undefined: it did not. Once. */
export function takeReturn(search: string, tab: TabStorage): Return | undefined {
  const query = new URLSearchParams(search);
  const state = query.get('state');
  const code = query.get('code');
  const error = query.get('error');
  if (state === null || (code === null && error === null)) return undefined;
  const kept = read(tab);
  tab.removeItem(KEY);
  const ours = kept !== undefined && kept.state === state;
  const refused = `you were not signed in (${(error ?? '').replace(/[^a-z_]/g, '').slice(0, 40)})`;
  return {
    state,
    code: code ?? '',
    codeVerifier: kept?.codeVerifier ?? '',
    path: kept?.path ?? '/',
    problem: !ours ? NOT_OURS : code === null ? refused : '',
  };
}

function read(tab: TabStorage): Kept | undefined {
  try {
    const kept = JSON.parse(tab.getItem(KEY) ?? 'null') as Partial<Kept> | null;
    if (typeof kept?.state !== 'string' || typeof kept.codeVerifier !== 'string') return undefined;
    // A path of this origin: not "//elsewhere".
    const path = /^\/(?!\/)[\w./?=&-]*$/.test(kept.path ?? '') ? (kept.path ?? '/') : '/';
    return { state: kept.state, codeVerifier: kept.codeVerifier, path };
  } catch {
    return undefined;
  }
}

function base64url(bytes: Uint8Array): string {
  const text = btoa(String.fromCharCode(...bytes));
  return text.replace(/\+/g, '-').replace(/\//g, '_').replace(/=+$/, '');
}
