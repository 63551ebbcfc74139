/** A packet as it goes over the wire. */
export interface Packet {
  readonly sequence: bigint;
  readonly captureNs: bigint;
  readonly opus: Uint8Array<ArrayBuffer>;
}

const MOST_WAITING = 25; // half a second: what is older is not worth hearing
const MOST_UNDER_WAY = 2; // a browser has few connections, and others need them

/**
 * Sends packets in the order they were spoken: at once while requests are answered quickly, several
 * in one while they are not, and the newest half second at the most.
 */
export class VoiceSender {
  private readonly waiting: Packet[] = [];
  private underWay = 0;
  private failures = 0;
  /** Packets that were too old when they could have been sent. */
  dropped = 0;

  constructor(private readonly send: (packets: Packet[]) => Promise<unknown>) {}

  /** True while nothing gets through. */
  get failing(): boolean {
    return this.failures >= 3;
  }

  push(packet: Packet): void {
    this.waiting.push(packet);
    if (this.waiting.length > MOST_WAITING) {
      this.waiting.shift();
      ++this.dropped;
    }
    this.flush();
  }

  clear(): void {
    this.waiting.length = 0;
  }

  private flush(): void {
    if (this.underWay >= MOST_UNDER_WAY || this.waiting.length === 0) return;
    ++this.underWay;
    this.send(this.waiting.splice(0))
      .then(
        () => (this.failures = 0),
        () => ++this.failures, // what was in it is too old by now
      )
      .finally(() => {
        --this.underWay;
        this.flush();
      });
  }
}
