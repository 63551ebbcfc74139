import { type LatencyMeter, STAGES } from '../session/latency';
import type { Session } from '../session/session';
import { h, setClass, setText } from './dom';
import { counted } from './words';

/** The bottom line: where the time goes, and what was lost. */
export class Strip {
  readonly element: HTMLElement;
  private readonly values = new Map<string, HTMLElement>();
  private readonly losses = h('span', { class: 'losses' });

  constructor() {
    this.element = h('footer', { 'aria-label': 'Latency by stage, median in milliseconds' });
    for (const stage of STAGES) {
      const value = h('span', { class: 'number' }, '–');
      this.values.set(stage, value);
      this.element.append(h('span', { class: 'stage', 'data-stage': stage }, `${stage} `, value));
    }
    this.element.append(
      h('span', { class: 'unit' }, 'ms'),
      h('span', { class: 'space' }),
      this.losses,
    );
  }

  /** `pageFps`: screen frames a second of this page. `problem`: goes before what was lost. */
  update(session: Session, meter: LatencyMeter, pageFps: number, problem: string): void {
    for (const stage of STAGES) {
      const times = session.live ? meter.get(stage) : undefined;
      const element = this.values.get(stage);
      if (!element) continue;
      setText(element, times ? times.p50.toFixed(0) : '–');
      if (element.parentElement) {
        element.parentElement.title = times
          ? `${stage}: median ${times.p50.toFixed(1)} ms, 95 % below ${times.p95.toFixed(1)} ms`
          : `${stage}: not measured yet`;
      }
    }
    setText(this.losses, problem || (session.live ? lossWords(session, pageFps) : ''));
    setClass(this.losses, 'problem', problem !== '');
  }
}

function lossWords({ statistics }: Session, pageFps: number): string {
  const parts: string[] = [];
  if (pageFps > 0 && pageFps < 45)
    parts.push(`this page draws only ${counted(Math.round(pageFps), 'time')} a second`);
  if (!statistics) return parts.join(' · ');
  const { badFrames, framesDropped, eventsSkipped, videoBitRate, trackedFps } = statistics;
  if (badFrames > 0) parts.push(counted(badFrames, 'bad frame'));
  if (framesDropped > 0) parts.push(`${counted(framesDropped, 'frame')} not tracked`);
  if (eventsSkipped > 0) parts.push(`${counted(eventsSkipped, 'event')} skipped`);
  parts.push(`tracked ${trackedFps.toFixed(0)} Hz`, `${(videoBitRate / 1e6).toFixed(1)} Mbit/s`);
  return parts.join(' · ');
}
