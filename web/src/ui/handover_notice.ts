import type { Session } from '../session/session';
import { h, setText } from './dom';
import { handoverWords } from './gaze_words';

const SHOWN_MS = 6000;

/** Says for some seconds that the camera has changed hands: to everybody. */
export class HandoverNotice {
  readonly element = h('p', { class: 'handover', role: 'status' });
  private seen: { readonly participantId: string; readonly handovers: number } | undefined;
  private untilMs = 0;
  private piloted = false; // it was I, until now

  constructor(private readonly session: Session) {}

  update(nowMs: number): void {
    const { gaze, participantId } = this.session;
    if (!gaze) return;
    const { handovers } = gaze;
    const news = this.seen?.participantId === participantId && this.seen.handovers !== handovers;
    this.seen = { participantId, handovers }; // what was before we came is no news
    if (news) {
      this.untilMs = nowMs + SHOWN_MS;
      const lostBy = this.piloted ? this.session.displayName : undefined;
      setText(this.element, handoverWords(gaze, participantId, lostBy));
    } else if (nowMs > this.untilMs) {
      setText(this.element, '');
    }
    this.piloted = gaze.pilot !== undefined && gaze.pilot.participantId === participantId;
  }
}
