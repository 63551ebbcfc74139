/** What tabs of one browser tell each other. */
interface Said {
  readonly kind: 'who' | 'here' | 'gone';
  readonly id: string;
  readonly sinceMs: number;
  readonly sessionId: string;
}

export interface Channel {
  postMessage(message: unknown): void;
  onmessage: ((event: MessageEvent) => void) | null;
}

// A browser opens six connections to one server (HTTP/1.1); each tab's stream takes one for itself, and
// what all of them ask, the pilot's heartbeats too, needs the rest.
export const MAX_STREAMS = 4;

const ANSWER_MS = 100;
const SURE_MS = 1000; // a page that draws without a graphics card may be busy for some hundred
const AGAIN_MS = 1000;

/**
 * Which tabs of this browser show the same server. The older ones go first: with one stream too many,
 * all of them would wait for each other without an end.
 */
export class Tabs {
  private readonly others = new Map<string, Said>();
  private wake: (() => void) | undefined;
  private sessionId = '';

  constructor(
    private readonly channel: Channel,
    private readonly id: string,
    private readonly sinceMs: number,
  ) {
    channel.onmessage = ({ data }: MessageEvent<Said>) => this.hear(data);
  }

  /** Asks who is there; what is known is complete once this resolves. `sure`: with busy ones as well. */
  async ask(signal: AbortSignal, sure = false): Promise<void> {
    this.others.clear();
    this.say('who');
    await this.pause(sure ? SURE_MS : ANSWER_MS, signal);
  }

  /** How many older ones there are; those that wait count as well, as they are before us. */
  get older(): number {
    const before = ({ sinceMs, id }: Said): boolean =>
      sinceMs < this.sinceMs || (sinceMs === this.sinceMs && id < this.id);
    return [...this.others.values()].filter(before).length;
  }

  /** False while this tab must not open a stream. */
  get mayStream(): boolean {
    return this.older < MAX_STREAMS;
  }

  /** Waits until it may; `told` hears how many tabs are before this one. */
  async turn(signal: AbortSignal, told: (older: number) => void): Promise<void> {
    while (!this.mayStream) {
      told(this.older);
      await this.pause(AGAIN_MS, signal, true);
      if (signal.aborted) return;
      await this.ask(signal);
    }
  }

  /** True if another tab goes on with that session: a duplicated tab has the same storage. */
  uses(sessionId: string): boolean {
    return [...this.others.values()].some((other) => other.sessionId === sessionId);
  }

  /** The session that this tab has from now on. */
  use(sessionId: string): void {
    this.sessionId = sessionId;
  }

  leave(): void {
    this.say('gone');
  }

  private say(kind: Said['kind']): void {
    const { id, sinceMs, sessionId } = this;
    this.channel.postMessage({ kind, id, sinceMs, sessionId } satisfies Said);
  }

  private hear(said: Said): void {
    if (said.kind === 'gone') {
      this.others.delete(said.id);
      this.wake?.();
      return;
    }
    this.others.set(said.id, said);
    if (said.kind === 'who') this.say('here');
  }

  /** `wakes`: less, if a tab goes. */
  private pause(ms: number, signal: AbortSignal, wakes = false): Promise<void> {
    return new Promise((resolve) => {
      const done = (): void => {
        clearTimeout(timer);
        signal.removeEventListener('abort', done);
        this.wake = undefined;
        resolve();
      };
      const timer = setTimeout(done, ms);
      signal.addEventListener('abort', done);
      if (wakes) this.wake = done;
    });
  }
}
