import { hasHead } from '../session/gaze';
import type { Session } from '../session/session';
import { plainWords } from '../transport/errors';
import { h, setClass, setText } from './dom';

const TIMEOUT = { timeoutMs: 2000 };
const SHOWN_MS = 6000;

/** What the wearer can always do to the head, whoever pilots: stop it, and take it over. */
export class WearerHead {
  readonly stop = h('button', { type: 'button', class: 'head hidden', title: 'X' });
  readonly take = h('button', { type: 'button', class: 'head hidden' });
  private failure = { text: '', untilMs: 0 };

  constructor(private readonly session: Session) {
    this.stop.addEventListener('click', () => this.toggleStop());
    this.take.addEventListener('click', () => this.toggleTake());
  }

  /** Why the last request failed, for some seconds. */
  get problem(): string {
    return performance.now() < this.failure.untilMs ? this.failure.text : '';
  }

  /** Nobody moves the head until this is lifted. */
  toggleStop(): void {
    const { gaze, clients, sessionId } = this.session;
    if (!hasHead(gaze)) return;
    const paused = !gaze.paused;
    this.attempt(() => clients.gaze.pause({ sessionId, paused }, TIMEOUT));
  }

  /** Mine: it looks straight ahead. Given back, who had it has it again. */
  private toggleTake(): void {
    const { clients, sessionId } = this.session;
    const enabled = !this.mine;
    this.attempt(async () => {
      await clients.gaze.override({ sessionId, enabled }, TIMEOUT);
      if (enabled && !this.session.gaze?.paused) await clients.gaze.home({ sessionId }, TIMEOUT);
    });
  }

  private get mine(): boolean {
    const { gaze, participantId } = this.session;
    return gaze?.pilot !== undefined && gaze.pilot.participantId === participantId;
  }

  update(): void {
    const { gaze, live } = this.session;
    const head = live && hasHead(gaze);
    setClass(this.stop, 'hidden', !head);
    setClass(this.take, 'hidden', !head);
    setText(this.stop, gaze?.paused ? '▶ Let the head move' : '■ Stop the head');
    setText(this.take, this.mine ? 'Give the head back' : 'Take the head over');
    this.stop.setAttribute('aria-pressed', String(gaze?.paused ?? false));
    this.take.setAttribute('aria-pressed', String(this.mine));
  }

  private attempt(act: () => Promise<unknown>): void {
    act().catch((error: unknown) => {
      this.failure = { text: plainWords(error), untilMs: performance.now() + SHOWN_MS };
    });
  }
}
