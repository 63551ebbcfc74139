import type { Session } from '../session/session';
import { plainWords } from '../transport/errors';

const TIMEOUT = { timeoutMs: 4000 };
const SHOWN_MS = 8000;

/** The wearer's large pause: asks the server, which stops pictures for everybody. */
export class PauseControl {
  private asked: boolean | undefined; // not answered yet
  private failure = { text: '', untilMs: 0 };

  constructor(private readonly session: Session) {}

  /** True while nobody is shown a picture, as far as is known here; at once when it was asked for. */
  get paused(): boolean {
    return this.asked === true || this.session.talk.pause !== undefined;
  }

  get waiting(): boolean {
    return this.asked !== undefined;
  }

  /** Why the last request failed, for some seconds: said loudly, for it is about being seen. */
  get problem(): string {
    return performance.now() < this.failure.untilMs ? this.failure.text : '';
  }

  toggle(): void {
    this.set(!this.paused);
  }

  set(paused: boolean): void {
    if (this.asked !== undefined) return;
    this.asked = paused;
    void this.ask(paused).finally(() => (this.asked = undefined));
  }

  private async ask(paused: boolean): Promise<void> {
    const { clients, sessionId, talk } = this.session;
    try {
      const { picturePause } = await clients.session.pausePicture({ sessionId, paused }, TIMEOUT);
      // The stream says it too, and may be late; a picture between the two would be wrong.
      if (picturePause) talk.receive({ case: 'picturePause', value: picturePause });
    } catch (error) {
      const what = paused ? 'NOT paused: the experts still see' : 'Still paused';
      this.failure = {
        text: `${what}. ${plainWords(error)}`,
        untilMs: performance.now() + SHOWN_MS,
      };
    }
  }
}
