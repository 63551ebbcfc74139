import type { Session } from '../session/session';
import { h, setText } from './dom';
import { handoverWords } from './gaze_words';

const SHOWN_MS = 6000;

/** Says for some seconds that the camera has changed hands: to everybody. */
export class HandoverNotice {
  readonly element = h('p', { class: 'handover', role: 'status' });
  private seen: { readonly sessionId: string; readonly handovers: number } | undefined;
  private untilMs = 0;

  constructor(private readonly session: Session) {}

  update(nowMs: number): void {
    const { gaze, sessionId } = this.session;
    if (!gaze) return;
    const { handovers } = gaze;
    const news = this.seen?.sessionId === sessionId && this.seen.handovers !== handovers;
    this.seen = { sessionId, handovers }; // what was before we came is no news
    if (news) {
      this.untilMs = nowMs + SHOWN_MS;
      setText(this.element, handoverWords(gaze, sessionId));
    } else if (nowMs > this.untilMs) {
      setText(this.element, '');
    }
  }
}
