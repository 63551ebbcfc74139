/** Why a picture was left out before it was coded. */
export type Held = 'encoder' | 'network' | 'server';

export interface Load {
  readonly encoding: number; // pictures that the encoder has not done
  readonly bufferedBytes: number; // that the socket has not sent
  readonly unanswered: number; // pictures sent, and newer than the last that was tracked
  readonly sinceSentMs: number;
}

const MOST_ENCODING = 2;
const MOST_BUFFERED_S = 0.15; // of the bit rate
const MOST_UNANSWERED = 10; // on their way, between the radio and the tracker
const PROBE_MS = 500; // now and then one goes, whatever the server does not say

/**
 * The newest picture wins: what cannot go at once is left out before it is coded, so that nothing
 * queues and no coded picture lacks what it refers to.
 */
export function held(load: Load, bitRate: number): Held | undefined {
  if (load.encoding >= MOST_ENCODING) return 'encoder';
  if (load.bufferedBytes > (bitRate / 8) * MOST_BUFFERED_S) return 'network';
  if (load.unanswered >= MOST_UNANSWERED && load.sinceSentMs < PROBE_MS) return 'server';
  return undefined;
}

const LEAST = 300_000;
const SURE_S = 5; // without a picture held before more is tried

/** Bits a second that the way takes: down at once, up slowly. */
export class BitRate {
  private goodSeconds = 0;

  constructor(
    private readonly most: number,
    public now = most,
  ) {}

  /** Once a second; `held`: pictures that the network held in it. True if the rate changed. */
  second(held: number): boolean {
    const before = this.now;
    if (held > 2) {
      this.goodSeconds = 0;
      this.now = Math.max(LEAST, Math.round(this.now * 0.7));
    } else if (++this.goodSeconds >= SURE_S) {
      this.goodSeconds = 0;
      this.now = Math.min(this.most, Math.round(this.now * 1.25));
    }
    return this.now !== before;
  }
}
