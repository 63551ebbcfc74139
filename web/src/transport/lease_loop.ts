import { Code, ConnectError } from '@connectrpc/connect';
import type { AcquireLeaseResponse } from '../gen/saccade/v1/gaze_pb';
import { plainWords } from './errors';

/** What comes back of asking for the lease again and again. */
export type LeaseTold =
  | {
      readonly kind: 'answer';
      readonly granted: boolean;
      readonly leaseId: string;
      readonly queuePosition: number;
      readonly pilot: string; // who has it
    }
  | { readonly kind: 'refused'; readonly reason: string };

const toTold = (reply: AcquireLeaseResponse): LeaseTold => ({
  kind: 'answer',
  granted: reply.granted,
  leaseId: reply.leaseId,
  queuePosition: reply.queuePosition,
  pilot: reply.pilot?.displayName ?? 'somebody',
});

type Acquire = (sessionId: string, leaseId: string) => Promise<AcquireLeaseResponse>;

export const HEARTBEAT_MS = 150; // the server waits 500 ms for one
const MAX_UNDER_WAY = 3; // a slow network delays heartbeats, it does not stop them
const PAGE_HANGS_MS = 2000;

/**
 * Asks for the lease, keeps a place in the queue, renews what was granted, one `beat` at a time.
 * Without a sign of life from the page it pauses; refused, it is over.
 */
export class LeaseLoop {
  private underWay = 0;
  private over = false;
  private heard = false;
  private leaseId = ''; // empty: not granted yet
  private aliveMs: number;

  constructor(
    private readonly acquire: Acquire,
    private readonly sessionId: string,
    private readonly told: (told: LeaseTold) => void,
    nowMs: number,
  ) {
    this.aliveMs = nowMs;
  }

  /** The page is there. */
  alive(nowMs: number): void {
    this.aliveMs = nowMs;
  }

  /** No more requests; true once none is under way either. */
  end(): boolean {
    this.over = true;
    return this.underWay === 0;
  }

  beat(nowMs: number): void {
    const hangs = nowMs - this.aliveMs > PAGE_HANGS_MS;
    const most = this.leaseId ? MAX_UNDER_WAY : 1;
    if (this.over || hangs || this.underWay >= most) return;
    ++this.underWay;
    this.acquire(this.sessionId, this.leaseId)
      .then(
        (reply) => this.answered(reply),
        (error: unknown) => this.failed(error),
      )
      .finally(() => --this.underWay);
  }

  private answered(reply: AcquireLeaseResponse): void {
    if (this.over) return;
    this.heard = true;
    this.leaseId = reply.leaseId;
    this.told(toTold(reply));
  }

  private failed(error: unknown): void {
    if (this.over || mayPass(error)) return;
    this.over = true;
    const reason = this.heard ? whyEnded(error) : plainWords(error);
    this.told({ kind: 'refused', reason });
  }
}

/** A lease that was passed on; else it is the session that the server does not know any more. */
function whyEnded(error: unknown): string {
  const { code } = ConnectError.from(error);
  const passedOn = code === Code.FailedPrecondition || code === Code.PermissionDenied;
  return passedOn ? 'the lease has ended' : 'the connection was lost';
}

/** True where the next heartbeat may fare better. */
function mayPass(error: unknown): boolean {
  const { code } = ConnectError.from(error);
  const passing = [Code.Unavailable, Code.Unknown, Code.DeadlineExceeded, Code.Canceled];
  return [...passing, Code.Aborted, Code.ResourceExhausted].includes(code);
}
