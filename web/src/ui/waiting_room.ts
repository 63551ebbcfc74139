import { AccessRole, type WaitingPerson } from '../gen/saccade/v1/access_pb';
import type { Session } from '../session/session';
import type { Access } from '../transport/access';
import { isRefusal, plainWords } from '../transport/errors';
import { h, setText } from './dom';

const LOOK_MS = 2000;
const MAY_ADMIT: readonly AccessRole[] = [AccessRole.WEARER, AccessRole.OWNER];

const ROLES: Partial<Record<AccessRole, string>> = {
  [AccessRole.VIEWER]: 'viewer: sees everything, changes nothing',
  [AccessRole.ANNOTATOR]: 'annotator: places marks',
  [AccessRole.PILOT]: 'pilot: places marks and turns the head',
  [AccessRole.WEARER]: 'wearer: may do everything',
};

/**
 * Who waits to be let in, for who may let them in: name, role, and two buttons. Says so to who does
 * not see it, and moves nobody's focus.
 */
export class WaitingRoom {
  readonly element: HTMLElement;
  private readonly list = h('ul', {});
  private readonly news = h('p', { class: 'news', role: 'status' });
  private readonly rows = new Map<string, HTMLElement>();
  private problem = '';
  private may: boolean | undefined; // nothing: not asked yet

  constructor(
    private readonly access: Access,
    private readonly session: Session,
  ) {
    this.element = h(
      'section',
      { class: 'waiting-room', 'aria-label': 'Waiting room' },
      this.news,
      this.list,
    );
  }

  start(): void {
    void this.look();
  }

  private async look(): Promise<void> {
    // Without a pass there is no waiting room; before one is in, nothing to ask.
    if (this.session.live && this.access.token) {
      try {
        if (!(await this.mayAdmit())) return;
        const { people } = await this.access.client.listWaiting({}, { timeoutMs: 5000 });
        this.show(people);
      } catch (error) {
        if (isRefusal(error)) {
          this.show([]);
          return;
        }
      }
    }
    setTimeout(() => void this.look(), LOOK_MS);
  }

  /** A pass has one role for as long as it lives. */
  private async mayAdmit(): Promise<boolean> {
    this.may ??= MAY_ADMIT.includes(
      (await this.access.client.getAccess({}, { timeoutMs: 5000 })).role,
    );
    return this.may;
  }

  private show(people: readonly WaitingPerson[]): void {
    const here = new Set(people.map(({ id }) => id));
    for (const [id, row] of this.rows) {
      if (here.has(id)) continue;
      row.remove();
      this.rows.delete(id);
    }
    for (const person of people) {
      if (this.rows.has(person.id)) continue;
      const row = this.rowOf(person);
      this.rows.set(person.id, row);
      this.list.append(row);
    }
    setText(this.news, this.problem || newsWords(people));
  }

  private rowOf(person: WaitingPerson): HTMLElement {
    const who = `${person.displayName}${person.label ? ` (${person.label})` : ''}`;
    const button = (text: string, refuse: boolean): HTMLElement => {
      const element = h('button', { type: 'button', 'aria-label': `${text} ${who}` }, text);
      element.addEventListener('click', () => void this.decide(person, refuse));
      return element;
    };
    return h(
      'li',
      {},
      h('strong', {}, who),
      h('span', { class: 'role' }, ROLES[person.role] ?? ''),
      h('span', { class: 'decide' }, button('Let in', false), button('Refuse', true)),
    );
  }

  private async decide(person: WaitingPerson, refuse: boolean): Promise<void> {
    try {
      await this.access.client.admit({ id: person.id, refuse }, { timeoutMs: 5000 });
      this.problem = '';
      this.rows.get(person.id)?.remove();
      this.rows.delete(person.id);
      setText(this.news, this.rows.size > 0 ? `${this.rows.size} still waiting` : '');
    } catch (error) {
      this.problem = `${person.displayName}: ${plainWords(error)}`;
      setText(this.news, this.problem);
    }
  }
}

function newsWords(people: readonly WaitingPerson[]): string {
  const [first] = people;
  if (!first) return '';
  return people.length === 1
    ? `${first.displayName} wants to come in`
    : `${people.length} people want to come in`;
}
