export interface AcknowledgerOptions {
  /** Sends one acknowledgement; resolves when answered. */
  readonly send: (sequence: bigint, requestKeyFrame: boolean) => Promise<void>;
  /** False while the decoder is behind: then nothing is acknowledged, and the server holds back. */
  readonly mayProceed: () => boolean;
  /** Events received before an acknowledgement goes out. */
  readonly every: number;
}

/**
 * Tells the server how far this page has come: cumulative, one request under way at a time. It is
 * what bounds staleness, so it speaks of what the decoder has kept up with, not of what arrived.
 */
export class Acknowledger {
  private received = 0n;
  private acknowledged = 0n;
  private keyFrameWanted = false;
  private busy = false;

  constructor(private readonly options: AcknowledgerOptions) {}

  /** An event arrived. */
  arrived(sequence: bigint): void {
    this.received = sequence;
    this.flush(this.options.every);
  }

  /** Sends what is due; called on a timer and when the decoder has caught up. */
  flush(atLeast = 1): void {
    const due = this.options.mayProceed() && this.received - this.acknowledged >= BigInt(atLeast);
    if (this.busy || (!due && !this.keyFrameWanted)) return;
    const sequence = due ? this.received : this.acknowledged;
    const wanted = this.keyFrameWanted;
    this.keyFrameWanted = false;
    this.busy = true;
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
}
