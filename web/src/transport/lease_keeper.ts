import type { LeaseTold } from './lease_loop';

export type ToKeeper =
  | {
      readonly kind: 'begin';
      readonly baseUrl: string;
      readonly sessionId: string;
      readonly token: string; // empty: none
    }
  | { readonly kind: 'alive' }
  | { readonly kind: 'end' };
export type FromKeeper =
  | { readonly kind: 'told'; readonly told: LeaseTold }
  | { readonly kind: 'ended' };

/** Asks for the lease and keeps it, or a place in the queue, until it is stopped. */
export interface LeaseKeeper {
  /** Resolves when no request is under way any more. */
  stop(): Promise<void>;
}

export interface LeaseKeeping {
  /** Makes ready to keep one at once. */
  warm(): void;
  keep(sessionId: string, told: (told: LeaseTold) => void): LeaseKeeper;
}

/** The main thread's end of the worker that asks, and sends the heartbeats. */
export class WorkerKeeping implements LeaseKeeping {
  private spare: Worker | undefined; // a worker takes its time to start, the server waits 500 ms

  constructor(
    private readonly baseUrl: string,
    private readonly token: () => string,
  ) {}

  warm(): void {
    this.spare ??= new Worker(new URL('./lease_worker.ts', import.meta.url), { type: 'module' });
  }

  keep(sessionId: string, told: (told: LeaseTold) => void): LeaseKeeper {
    this.warm();
    const worker = this.spare;
    if (!worker) throw new Error('no worker');
    this.spare = undefined;
    const send = (message: ToKeeper): void => worker.postMessage(message);
    let stopped: (() => void) | undefined;
    worker.onmessage = ({ data: message }: MessageEvent<FromKeeper>) => {
      if (message.kind === 'ended') {
        worker.terminate();
        stopped?.();
      } else if (!stopped) {
        told(message.told);
      }
    };
    send({ kind: 'begin', baseUrl: this.baseUrl, sessionId, token: this.token() });
    // This page's own timers stop when it hangs: then the heartbeats stop as well.
    const alive = setInterval(() => send({ kind: 'alive' }), 300);
    return {
      stop: () =>
        new Promise((resolve) => {
          stopped = resolve;
          clearInterval(alive);
          send({ kind: 'end' });
        }),
    };
  }
}
