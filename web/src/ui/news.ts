import type { Session } from '../session/session';
import type { ChatMessage } from '../session/talk_state';
import type { Annotation } from '../session/types';
import { shapeWord } from './words';

const PARTS_MS = 1500;

/** One line of what somebody else did or said last. */
export interface News {
  readonly text: string;
  readonly atMs: number; // performance.now()
}

/** Notices marks and messages of others as they come; what was there before is no news. */
export class NewsWatch {
  newest: News | undefined;
  private readonly known = new Set<string>();
  private seenVersion = 0;
  private newsFromMs = Infinity;

  constructor(
    private readonly session: Session,
    private readonly told: () => void,
  ) {
    session.talk.onMessage = (message) => {
      if (message.participantId === session.participantId) return;
      this.tell(messageWords(message, session.annotations.get(message.annotationId)));
    };
  }

  /** Once per screen frame. */
  update(): void {
    const { annotations, live } = this.session;
    if (!live || annotations.version === this.seenVersion) return;
    this.seenVersion = annotations.version;
    const fresh = annotations.list().filter(({ id }) => !this.known.has(id));
    for (const { id } of fresh) this.known.add(id);
    const nowMs = performance.now();
    // The first state comes in parts, one right after the other.
    this.newsFromMs = Math.min(this.newsFromMs, nowMs + PARTS_MS);
    if (nowMs < this.newsFromMs) return;
    const mark = fresh.filter(({ author }) => author !== this.session.displayName).at(-1);
    if (mark) this.tell(markWords(mark));
  }

  private tell(text: string): void {
    this.newest = { text, atMs: performance.now() };
    this.told();
  }
}

export const markWords = ({ author, shape, text }: Annotation): string =>
  `${author} placed a ${shapeWord(shape)}${text ? `: ${text}` : ''}`;

/** "Ann: the left screw (note “oil”)"; "Ann: look at cube". */
export function messageWords(message: ChatMessage, mark: Annotation | undefined): string {
  const { name, text, annotationId } = message;
  if (!annotationId) return `${name}: ${text}`;
  const what = mark ? titleOf(mark) : 'a mark that is gone';
  return text ? `${name}: ${text} (${what})` : `${name}: look at ${what}`;
}

/** What a mark is called in a line. */
export const titleOf = ({ shape, text }: Annotation): string =>
  text ? `${shapeWord(shape)} “${text.split('\n', 1)[0] ?? ''}”` : `the ${shapeWord(shape)}`;
