import type { Session } from '../session/session';
import type { Landing } from '../tools/landing';

/** Has the server keep the frame that was clicked: what is to be there takes longer than frames are kept. */
export function holdFrame(session: Session, { target }: Landing): void {
  if (target.kind !== 'pixel') return;
  session.fetchPng(target.frameId).catch(() => undefined); // then the ray has to do
}
