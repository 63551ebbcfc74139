import type { LeaseTold } from './lease_loop';

export type ToKeeper =
  | {
      readonly kind: 'begin';
      readonly baseUrl: string;
      readonly sessionId: string;
      readonly leaseId: string;
    }
  | { readonly kind: 'alive' }
  | { readonly kind: 'end' };
export type FromKeeper =
  | { readonly kind: 'told'; readonly told: LeaseTold }
  | { readonly kind: 'ended' };

/** Keeps a lease, or a place in the queue (`leaseId` empty), until it is stopped. */
export interface LeaseKeeper {
  /** Resolves when no request is under way any more. */
  stop(): Promise<void>;
}
export type KeepLease = (
  sessionId: string,
  leaseId: string,
  told: (told: LeaseTold) => void,
) => LeaseKeeper;

/** The main thread's end of the worker that sends the heartbeats. */
export const keepLeaseAt =
  (baseUrl: string): KeepLease =>
  (sessionId, leaseId, told) => {
    const worker = new Worker(new URL('./lease_worker.ts', import.meta.url), { type: 'module' });
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
    send({ kind: 'begin', baseUrl, sessionId, leaseId });
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
  };
