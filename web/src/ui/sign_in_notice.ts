import { AccessRole } from '../gen/saccade/v1/access_pb';
import type { Session } from '../session/session';
import type { Access } from '../transport/access';
import { plainWords } from '../transport/errors';
import { beginSignIn } from '../transport/sign_in';
import { h, setText, tabStorage } from './dom';

const LOOK_MS = 300;

/** For who was not let in, or is out: the way in by their firm, where the server knows one. */
export class SignInNotice {
  readonly element: HTMLElement;
  private readonly button = h('button', { type: 'button' });
  private readonly news = h('p', { class: 'news', role: 'status' });

  constructor(
    private readonly access: Access,
    private readonly session: Session,
  ) {
    this.button.addEventListener('click', () => void this.leave());
    this.element = h(
      'section',
      { class: 'sign-in', 'aria-label': 'Sign in', hidden: '' },
      this.button,
      this.news,
    );
  }

  start(): void {
    const timer = setInterval(() => {
      if (this.session.link.kind !== 'refused') return;
      clearInterval(timer);
      void this.show();
    }, LOOK_MS);
  }

  private async show(): Promise<void> {
    const told = await this.access.client.getAccess({}, { timeoutMs: 5000 }).catch(() => undefined);
    // Who has a pass is refused for something else.
    if (!told?.signInName || told.waiting || told.role !== AccessRole.UNSPECIFIED) return;
    setText(this.button, `Sign in with ${told.signInName}`);
    this.element.hidden = false;
  }

  private async leave(): Promise<void> {
    this.button.disabled = true;
    setText(this.news, '');
    try {
      const path = location.pathname + location.search;
      location.assign(await beginSignIn(this.access.client, location.origin, path, tabStorage()));
    } catch (error) {
      setText(this.news, plainWords(error));
    }
    this.button.disabled = false;
  }
}
