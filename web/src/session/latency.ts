import type { FrameFacts } from './types';

export const STAGES = ['capture', 'track', 'encode', 'network', 'decode', 'draw'] as const;
export type Stage = (typeof STAGES)[number];

export interface Percentiles {
  readonly p50: number;
  readonly p95: number;
}

export type StageTimes = Record<Stage | 'total', number>;

/** How long one shown frame spent in each stage [ms]; undefined without a clock offset. */
export function stageTimes(
  facts: FrameFacts,
  decodedMs: number,
  drawnMs: number,
  offsetMs: number | undefined,
): StageTimes | undefined {
  const { captured, received, tracked, encoded } = facts.stages;
  if (offsetMs === undefined || captured === 0 || encoded === 0) return undefined;
  const serverNow = (pageMs: number): number => pageMs + offsetMs;
  const afterTrack = tracked || received;
  return {
    capture: received - captured,
    track: afterTrack - received,
    encode: encoded - afterTrack,
    network: serverNow(facts.arrivedMs) - encoded,
    decode: decodedMs - facts.arrivedMs,
    draw: drawnMs - decodedMs,
    total: serverNow(drawnMs) - captured,
  };
}

/** Percentiles of the last `capacity` frames, by stage. */
export class LatencyMeter {
  private times: StageTimes[] = [];

  constructor(private readonly capacity = 90) {}

  add(times: StageTimes): void {
    this.times.push(times);
    if (this.times.length > this.capacity) this.times.shift();
  }

  clear(): void {
    this.times = [];
  }

  get(stage: Stage | 'total'): Percentiles | undefined {
    if (this.times.length === 0) return undefined;
    const sorted = this.times.map((t) => t[stage]).sort((a, b) => a - b);
    const at = (q: number): number => sorted[Math.floor(q * (sorted.length - 1))] ?? 0;
    return { p50: at(0.5), p95: at(0.95) };
  }
}

/** Events a second over the last two seconds. */
export class RateMeter {
  private stamps: number[] = [];

  add(nowMs: number): void {
    this.stamps.push(nowMs);
    this.trim(nowMs);
  }

  rate(nowMs: number): number {
    this.trim(nowMs);
    const first = this.stamps[0];
    const span = first === undefined ? 0 : nowMs - first;
    return span < 300 ? 0 : ((this.stamps.length - 1) * 1000) / span;
  }

  private trim(nowMs: number): void {
    while (this.stamps.length > 0 && nowMs - (this.stamps[0] ?? nowMs) > 2000) this.stamps.shift();
  }
}
