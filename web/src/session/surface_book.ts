import { Code, ConnectError } from '@connectrpc/connect';
import type {
  GetSurfaceRequest,
  GetSurfaceResponse,
  SurfaceChunk,
  SurfaceEvent,
} from '../gen/saccade/v1/surface_pb';
import { Backoff } from '../transport/backoff';
import { sleep } from './sleep';

/** What the book asks of the server. */
export interface SurfaceCalls {
  get(
    request: Pick<GetSurfaceRequest, 'sessionId' | 'edition' | 'version' | 'maxBytes'>,
    options: { signal: AbortSignal; timeoutMs: number },
  ): Promise<GetSurfaceResponse>;
}

/** What there is to show. */
export type SurfaceState =
  | 'unknown' // not asked yet
  | 'none yet'
  | 'some'
  | 'not made'; // by this server, ever

export interface Clock {
  nowMs(): number;
  sleep(ms: number, signal: AbortSignal): Promise<void>;
}

const CLOCK: Clock = { nowMs: () => performance.now(), sleep };

const TIMEOUT_MS = 10_000;
const ANSWER_MS = 250; // one is to take so long at most: pose, map and video share the link
const [LEAST_BYTES, FIRST_BYTES, MOST_BYTES] = [8192, 65_536, 524_288]; // surface.proto
const LEAST_REST_MS = 50;
const MOST_BACKOFF_MS = 20_000;

export const nameOf = ({ x, y, z }: Pick<SurfaceChunk, 'x' | 'y' | 'z'>): string =>
  `${x} ${y} ${z}`;

/**
 * The surfaces of the place, as far as they were fetched: chunks as they came. One request at a time, and after
 * each a rest as long as the answer took, so that they never have more than half of a link.
 */
export class SurfaceBook {
  readonly chunks = new Map<string, SurfaceChunk>();
  state: SurfaceState = 'unknown';
  /** Rises with each change of the state. */
  version = 0;
  private edition = 0n;
  private has = 0n; // all of the edition up to this version
  private news = { edition: 0n, version: 0n };
  private wanted = false;
  private asked = false; // over this connection
  private more = false;
  private readonly changed = new Set<string>();
  private wake: (() => void) | undefined;
  private bytes = FIRST_BYTES;

  constructor(private readonly clock: Clock = CLOCK) {}

  /** Whether somebody looks at them: nothing is fetched for nobody. */
  want(wanted: boolean): void {
    if (this.wanted === wanted) return;
    this.wanted = wanted;
    this.wake?.();
  }

  apply({ edition, version }: SurfaceEvent): void {
    this.news = { edition, version };
    // A server that was started again, with less than there was.
    if (edition === this.edition && version < this.has) this.forget();
    this.wake?.();
  }

  /** The next chunk that is to be drawn anew, or, without triangles, no more; undefined: all is drawn. */
  takeChanged(): { readonly name: string; readonly chunk: SurfaceChunk | undefined } | undefined {
    const [name] = this.changed;
    if (name === undefined) return undefined;
    this.changed.delete(name);
    return { name, chunk: this.chunks.get(name) };
  }

  /** Fetches over this connection what is new, until `signal`. */
  async follow(calls: SurfaceCalls, sessionId: string, signal: AbortSignal): Promise<void> {
    this.asked = this.more = false;
    this.news = { edition: this.edition, version: this.has };
    const backoff = new Backoff(Math.random, MOST_BACKOFF_MS);
    while (await this.isDue(signal)) {
      const begin = this.clock.nowMs();
      try {
        const { edition, bytes: maxBytes } = this;
        const request = { sessionId, edition, version: this.has, maxBytes };
        const answer = await calls.get(request, { signal, timeoutMs: TIMEOUT_MS });
        if (signal.aborted) return;
        this.take(answer);
        backoff.reset();
      } catch (error) {
        if (signal.aborted) return;
        if (ConnectError.from(error).code === Code.Unimplemented) {
          this.setState('not made');
          return;
        }
        this.bytes = LEAST_BYTES;
        await this.clock.sleep(backoff.nextMs(), signal);
        continue;
      }
      const tookMs = Math.max(this.clock.nowMs() - begin, 1);
      this.suit(tookMs);
      await this.clock.sleep(Math.max(tookMs, LEAST_REST_MS), signal);
    }
  }

  /** True once there is something to ask for; false: the connection has ended. */
  private async isDue(signal: AbortSignal): Promise<boolean> {
    const end = (): void => this.wake?.();
    signal.addEventListener('abort', end);
    while (!signal.aborted && !this.isBehind) {
      await new Promise<void>((resolve) => (this.wake = resolve));
    }
    signal.removeEventListener('abort', end);
    return !signal.aborted;
  }

  private get isBehind(): boolean {
    const { news, edition, has, asked, more } = this;
    const isNew = news.edition !== edition || news.version > has;
    return this.wanted && (!asked || more || isNew);
  }

  private take(answer: GetSurfaceResponse): void {
    const { edition, version, chunks, more } = answer;
    this.asked = true;
    this.more = more;
    if (edition !== this.edition || version < this.has) this.forget();
    this.edition = edition;
    this.has = version;
    // It is newer than what was heard of: another edition, or that of before.
    if (this.news.edition !== edition) this.news = { edition, version };
    for (const chunk of chunks) {
      const name = nameOf(chunk);
      if (chunk.triangleCount === 0) this.chunks.delete(name);
      else this.chunks.set(name, chunk);
      this.changed.add(name);
    }
    if (edition === 0n) this.setState('not made');
    else this.setState(this.chunks.size > 0 ? 'some' : 'none yet');
  }

  /** Of the next answer, for the link there is. */
  private suit(tookMs: number): void {
    const bytes = (this.bytes * ANSWER_MS) / tookMs;
    this.bytes = Math.round(Math.min(Math.max(bytes, LEAST_BYTES), 2 * this.bytes, MOST_BYTES));
  }

  private forget(): void {
    for (const name of this.chunks.keys()) this.changed.add(name);
    this.chunks.clear();
    this.edition = this.has = 0n;
    this.setState('none yet');
  }

  private setState(state: SurfaceState): void {
    if (state !== this.state) ++this.version;
    this.state = state;
  }
}
