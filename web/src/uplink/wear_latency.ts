import type { WearerTracked } from '../gen/saccade/v1/wearer_pb';
import type { Sent } from './sent';

export const WEAR_STAGES = ['encode', 'uplink', 'decode', 'track', 'back', 'draw'] as const;
export type WearStage = (typeof WEAR_STAGES)[number];
export type WearTimes = Record<WearStage | 'total', number>;

const ms = (ns: bigint): number => Number(ns) / 1e6;

/**
 * How long one picture took from the camera to its marks on this phone [ms]. `offsetMs`: server's
 * clock minus this page's; only the two ways depend on it, the total does not.
 */
export function wearTimes(
  sent: Sent,
  tracked: WearerTracked,
  arrivedMs: number,
  drawnMs: number,
  offsetMs: number,
): WearTimes {
  return {
    encode: sent.encodedMs - sent.capturedMs,
    uplink: ms(tracked.receivedNs) - offsetMs - sent.encodedMs,
    decode: ms(tracked.decodedNs - tracked.receivedNs),
    track: ms(tracked.trackedNs - tracked.decodedNs),
    back: arrivedMs - (ms(tracked.trackedNs) - offsetMs),
    draw: drawnMs - arrivedMs,
    total: drawnMs - sent.capturedMs,
  };
}

/** Of the last `most` pictures. */
export class WearMeter {
  private readonly times: WearTimes[] = [];

  constructor(private readonly most = 300) {}

  add(times: WearTimes): void {
    this.times.push(times);
    if (this.times.length > this.most) this.times.shift();
  }

  /** Undefined before the first. */
  percentile(stage: WearStage | 'total', q: number): number | undefined {
    const sorted = this.times.map((times) => times[stage]).sort((a, b) => a - b);
    return sorted[Math.floor(q * (sorted.length - 1))];
  }

  clear(): void {
    this.times.length = 0;
  }
}
