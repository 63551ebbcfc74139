import { RecordingWatch } from '../session/recording';
import type { Session } from '../session/session';
import { h, setClass, setText } from './dom';
import { whyNotEdit } from './rights';

const FAILURE_MS = 8000;

/** "0:07", "12:04", "1:02:33". */
export function durationWords(ms: number): string {
  const s = Math.max(0, Math.floor(ms / 1000));
  const two = (value: number): string => String(value).padStart(2, '0');
  const [hours, minutes] = [Math.floor(s / 3600), Math.floor(s / 60) % 60];
  return hours > 0 ? `${hours}:${two(minutes)}:${two(s % 60)}` : `${minutes}:${two(s % 60)}`;
}

/** Says that a session is recorded, and begins and ends it. */
export class RecordControl {
  readonly button = h('button', { type: 'button', class: 'record' });
  readonly watch: RecordingWatch;
  private failedMs = -Infinity;

  constructor(private readonly session: Session) {
    this.watch = new RecordingWatch(session);
    this.button.addEventListener('click', () => void this.toggle());
  }

  async toggle(): Promise<void> {
    await this.watch.toggle();
    if (this.watch.failure !== '') this.failedMs = performance.now();
  }

  /** Why it does not record though somebody wanted it to; empty: nothing is wrong. */
  get problem(): string {
    const { failure, state } = this.watch;
    if (performance.now() - this.failedMs < FAILURE_MS) return failure;
    return state && !state.on && state.problem !== '' ? `Recording stopped: ${state.problem}` : '';
  }

  update(nowMs: number): void {
    const { session, watch } = this;
    watch.update(nowMs);
    const { state } = watch;
    const viewer = whyNotEdit(session) !== undefined;
    setClass(this.button, 'hidden', !session.live || (viewer && !watch.on));
    this.button.disabled = viewer;
    this.button.setAttribute('aria-pressed', String(watch.on));
    setText(
      this.button,
      state?.on ? `● REC ${durationWords(Date.now() - state.sinceMs)}` : 'Record',
    );
    this.button.title = state?.on
      ? `${viewer ? 'Recorded' : 'Ends the recording'}: ${state.file}, ${(state.bytes / 1e6).toFixed(1)} MB`
      : 'Records video, map, marks and messages on the server; no voices';
  }
}
