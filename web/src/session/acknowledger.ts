export interface AcknowledgerOptions {
  /** Sends one acknowledgement; resolves when answered. */
  readonly send: (sequence: bigint, requestKeyFrame: boolean) => Promise<void>;
  /** False while the decoder is behind: then nothing is acknowledged, and the server holds back. */
  readonly mayProceed: () => boolean;
  /** Events received before an acknowledgement goes out. */
  readonly every: number;
  readonly nowMs?: () => number;
}

// The server ends a stream that acknowledges nothing for 30 s: its page has vanished.
const AT_LATEST_MS = 2000;
const BEHIND_AT_LATEST_MS = 6000; // a decoder that is behind holds back, but is still there

/**
 * Tells the server how far this page has come: cumulative, one request under way at a time. It is
 * what bounds staleness, so it speaks of what the decoder has kept up with, not of what arrived; and
 * it is the sign that somebody is there, so it speaks now and then whatever happens.
 */
export class Acknowledger {
  private received = 0n;
  private acknowledged = 0n;
  private keyFrameWanted = false;
  private busy = false;
  private readonly nowMs: () => number;
  private sentMs: number;

  constructor(private readonly options: AcknowledgerOptions) {
    this.nowMs = options.nowMs ?? (() => performance.now());
    this.sentMs = this.nowMs();
  }

  /** An event arrived. */
  arrived(sequence: bigint): void {
    this.received = sequence;
    this.flush(this.options.every);
  }

  /** Sends what is due; called on a timer, with every event, and when the decoder has caught up. */
  flush(atLeast = 1): void {
    const due = this.due(BigInt(atLeast));
    if (this.busy || (!due && !this.keyFrameWanted)) return;
    const sequence = due ? this.received : this.acknowledged;
    const wanted = this.keyFrameWanted;
    this.keyFrameWanted = false;
    this.busy = true;
    this.sentMs = this.nowMs();
    this.options
      .send(sequence, wanted)
      .then(
        () => {
          this.acknowledged = sequence;
        },
        () => {
          // The stream's own failure ends the subscription; a lost acknowledgement is sent again.
          this.keyFrameWanted ||= wanted;
        },
      )
      .finally(() => {
        this.busy = false;
      });
  }

  requestKeyFrame(): void {
    this.keyFrameWanted = true;
    this.flush();
  }

  private due(atLeast: bigint): boolean {
    const silentMs = this.nowMs() - this.sentMs;
    if (!this.options.mayProceed()) return silentMs >= BEHIND_AT_LATEST_MS && this.received > 0n;
    if (silentMs >= AT_LATEST_MS) return this.received > 0n;
    return this.received - this.acknowledged >= atLeast;
  }
}
