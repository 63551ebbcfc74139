import {
  type Client,
  Code,
  ConnectError,
  createClient,
  type Interceptor,
} from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AccessService } from '../gen/saccade/v1/access_pb';
import type { Return } from './sign_in';

type PassStorage = Pick<Storage, 'getItem' | 'setItem' | 'removeItem'>;

/** What an invite was redeemed for: of the invite, only its id is kept. */
interface Pass {
  readonly inviteId: string;
  readonly token: string;
}

const LOOK_MS = 1000; // whether one was let in
const KEY = 'saccade.pass';
const FRAGMENT = /^#invite=(.+)$/;

/** The invite of a link, "ID.SECRET"; undefined: the link has none. */
export const inviteOf = (hash: string): string | undefined => FRAGMENT.exec(hash)?.[1];

/** Puts the token on every call. */
export const bearing =
  (token: () => string): Interceptor =>
  (next) =>
  (request) => {
    if (token()) request.header.set('authorization', `Bearer ${token()}`);
    return next(request);
  };

/**
 * What lets this browser in. An invite is redeemed once, and so is the code of a sign-in; the pass that
 * comes of it is kept for this tab, and for those that are opened without either later.
 */
export class Access {
  private pass: Pass | undefined;
  readonly client: Client<typeof AccessService>;

  constructor(
    baseUrl: string,
    private invite: string | undefined,
    private readonly tab: PassStorage,
    private readonly browser: Pick<Storage, 'getItem' | 'setItem'>,
    client?: Client<typeof AccessService>,
    private signIn?: Return,
  ) {
    const interceptors = [bearing(() => this.token)];
    this.client =
      client ?? createClient(AccessService, createGrpcWebTransport({ baseUrl, interceptors }));
    this.pass = read(tab) ?? read(browser);
    // A link that was opened before: its invite may be used up, its pass still holds.
    if (invite !== undefined && this.pass?.inviteId === idOf(invite)) this.invite = undefined;
  }

  /** Empty: none. */
  get token(): string {
    return this.pass?.token ?? '';
  }

  /**
   * Redeems the invite of the link, if that was not done yet, under the name that who lets people in
   * sees; `waiting` is told while nobody has. Rejects if one is not let in.
   */
  async enter(signal: AbortSignal, displayName = '', waiting?: () => void): Promise<void> {
    const { invite } = this;
    if (invite !== undefined) await this.redeem(invite, displayName, signal);
    else if (this.signIn !== undefined) await this.finish(this.signIn, signal);
    if (this.pass === undefined) return;
    for (;;) {
      const told = await this.client.getAccess({}, { signal, timeoutMs: 5000 });
      if (!told.waiting) return; // what else there is to say, joining says
      waiting?.();
      await sleep(LOOK_MS, signal);
      signal.throwIfAborted();
    }
  }

  private async redeem(invite: string, displayName: string, signal: AbortSignal): Promise<void> {
    this.pass = undefined; // who opens another link means that one
    const request = { invite, displayName };
    const { token } = await this.client.redeem(request, { signal, timeoutMs: 5000 });
    this.invite = undefined;
    this.keep({ inviteId: idOf(invite), token });
  }

  private async finish(signIn: Return, signal: AbortSignal): Promise<void> {
    const { state, code, codeVerifier, problem } = signIn;
    this.pass = undefined; // who signs in means that
    if (problem) throw new ConnectError(problem, Code.Unauthenticated);
    const request = { state, code, codeVerifier };
    this.signIn = undefined; // a code is taken once, whatever comes of it
    const { token } = await this.client.finishSignIn(request, { signal, timeoutMs: 20_000 });
    this.keep({ inviteId: '', token });
  }

  private keep(pass: Pass): void {
    this.pass = pass;
    const kept = JSON.stringify(this.pass);
    for (const storage of [this.tab, this.browser]) {
      try {
        storage.setItem(KEY, kept);
      } catch {
        // Full or forbidden: then a reload needs a new link.
      }
    }
  }
}

const sleep = (ms: number, signal: AbortSignal): Promise<void> =>
  new Promise((resolve) => {
    const timer = setTimeout(resolve, ms);
    const stop = (): void => {
      clearTimeout(timer);
      resolve();
    };
    signal.addEventListener('abort', stop, { once: true });
  });

const idOf = (invite: string): string => invite.split('.', 1)[0] ?? '';

function read(storage: Pick<Storage, 'getItem'>): Pass | undefined {
  try {
    const kept: unknown = JSON.parse(storage.getItem(KEY) ?? 'null');
    if (typeof kept !== 'object' || kept === null) return undefined;
    const { inviteId, token } = kept as { inviteId?: unknown; token?: unknown };
    if (typeof inviteId !== 'string' || typeof token !== 'string') return undefined;
    return { inviteId, token };
  } catch {
    return undefined;
  }
}
