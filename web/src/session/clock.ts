import type { Clients } from '../transport/clients';
import { sleep } from './sleep';

interface Sample {
  readonly offsetMs: number;
  readonly roundTripMs: number;
}

/** Offset of the server's clock from this page's, from pings as in NTP: the quickest of the last 16. */
export class ClockOffset {
  private samples: Sample[] = [];

  /** All times in ms; t0 and t3 on this page's clock, t1 and t2 on the server's. */
  add(t0: number, t1: number, t2: number, t3: number): void {
    this.samples.push({ offsetMs: (t1 - t0 + (t2 - t3)) / 2, roundTripMs: t3 - t0 - (t2 - t1) });
    if (this.samples.length > 16) this.samples.shift();
  }

  /** Server time = page time + this; undefined before the first ping. */
  get offsetMs(): number | undefined {
    return this.best?.offsetMs;
  }

  get roundTripMs(): number | undefined {
    return this.best?.roundTripMs;
  }

  reset(): void {
    this.samples = [];
  }

  private get best(): Sample | undefined {
    let best: Sample | undefined;
    for (const sample of this.samples) {
      if (!best || sample.roundTripMs < best.roundTripMs) best = sample;
    }
    return best;
  }
}

/**
 * When the browser itself sent the request whose address ends in `suffix` and that this page made
 * at `askedMs` or later, and when its answer began to arrive [ms, this page's clock]: the page's own
 * stamps would include its waiting. Undefined if the browser has not recorded it (yet).
 */
export function wireTimes(
  suffix: string,
  askedMs: number,
): { sentMs: number; answeredMs: number } | undefined {
  const origin = performance.timeOrigin;
  const entry = (performance.getEntriesByType('resource') as PerformanceResourceTiming[])
    .filter(({ name }) => name.endsWith(suffix))
    .at(-1);
  performance.clearResourceTimings(); // else the browser stops recording at 250
  // Half a millisecond: browsers round these times.
  if (!entry || origin + entry.startTime < askedMs - 0.5) return undefined;
  if (entry.requestStart === 0 || entry.responseStart === 0) return undefined;
  return { sentMs: origin + entry.requestStart, answeredMs: origin + entry.responseStart };
}

/** This page's clock [ms], the same in its workers. */
export const pageNowMs = (): number => performance.timeOrigin + performance.now();

/** One measurement; without an answer none. */
export async function ping(
  session: Clients['session'],
  clock: ClockOffset,
  signal: AbortSignal,
): Promise<void> {
  const sent = pageNowMs();
  try {
    const reply = await session.ping(
      { clientSendNs: BigInt(Math.round(sent * 1e6)) },
      { signal, timeoutMs: 2000 },
    );
    const t1 = Number(reply.serverReceiveNs) / 1e6;
    const t2 = Number(reply.serverSendNs) / 1e6;
    const answered = pageNowMs();
    await sleep(20, signal); // the browser records a request shortly after it has ended
    const wire = wireTimes('/Ping', sent);
    clock.add(wire?.sentMs ?? sent, t1, t2, wire?.answeredMs ?? answered);
  } catch {
    // The stream's silence says the same, and says it to the reader.
  }
}
