import { newUuid } from '../session/uuid';
import type { Session } from '../session/session';
import type { ChatMessage } from '../session/talk_state';
import { VoiceRoom } from '../talk/voice_room';
import { bytesOf } from '../tools/note_text';
import { plainWords } from '../transport/errors';
import type { AppState } from './app_state';
import { h, setClass, setText, storage } from './dom';
import { messageWords, titleOf } from './news';
import { VoiceBar } from './voice_bar';
import { clockWords } from './words';

const OPEN = 'saccade.talkOpen';
const MOST_BYTES = 500;
const SHEETS = '(max-width: 599px), (max-height: 520px)'; // as small.css has it
const TIMEOUT = { timeoutMs: 5000 };

/** What people say: voices, and lines that may carry a mark ("look here"). */
export class TalkPanel {
  readonly element: HTMLElement;
  readonly room: VoiceRoom;
  readonly voice: VoiceBar;
  private readonly head = h('button', { type: 'button', class: 'talk-head' });
  private readonly count = h('span', { class: 'number' });
  private readonly latest = h('span', { class: 'latest', dir: 'auto' });
  private readonly body: HTMLElement;
  private readonly list = h('ul', {});
  private readonly log = h(
    'div',
    { class: 'messages', role: 'log', tabindex: '0', 'aria-label': 'Messages' },
    this.list,
  );
  private readonly field = h('input', {
    type: 'text',
    'aria-label': 'Message',
    'aria-keyshortcuts': '9',
    placeholder: 'Message (9)',
    autocomplete: 'off',
  });
  private readonly chip = h('button', { type: 'button', class: 'chip' });
  private readonly why = h('p', { class: 'why', role: 'alert' });
  private readonly rows = new Map<number, HTMLElement>();
  private open = storage().getItem(OPEN) === 'yes';
  private carries = false; // the selected mark goes with the next message
  private seen = 0; // number
  private began = false;
  private drawn = '';

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly show: (annotationId: string) => void,
    private readonly onWrite: () => void,
  ) {
    this.room = new VoiceRoom(session);
    this.voice = new VoiceBar(session, this.room);
    this.head.append(h('span', {}, 'Talk'), this.latest, this.count);
    this.head.addEventListener('click', () => this.setOpen(!this.open));
    this.chip.addEventListener('click', () => {
      this.carries = !this.carries;
      state.changed();
    });
    const send = h('button', { type: 'submit' }, 'Send');
    const form = h('form', { class: 'say' }, this.chip, this.field, send);
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.send();
    });
    this.field.addEventListener('keydown', ({ key }) => {
      if (key === 'Escape') this.field.blur();
    });
    this.body = h('div', { class: 'talk-body' }, this.voice.element, this.log, form, this.why);
    this.element = h(
      'section',
      { class: 'talk', 'aria-label': 'Talk' },
      h('h2', {}, this.head),
      this.body,
    );
  }

  /** Messages that came since the panel was last open. */
  get unread(): number {
    return this.session.talk.messages.filter(({ number }) => number > this.seen).length;
  }

  /** The keyboard goes to the field. */
  write(): void {
    if (window.matchMedia(SHEETS).matches) this.state.sheet = 'talk';
    else this.setOpen(true);
    this.state.changed();
    this.onWrite();
    this.update();
    this.field.focus();
  }

  private setOpen(open: boolean): void {
    this.open = open;
    try {
      storage().setItem(OPEN, open ? 'yes' : 'no');
    } catch {
      // Full: then it is as it was after a reload.
    }
    this.state.changed();
  }

  private async send(): Promise<void> {
    const { session, state, field } = this;
    const text = field.value.trim();
    const annotationId = this.carries ? (state.selectedId ?? '') : '';
    if (text === '' && annotationId === '') return;
    const over = bytesOf(text) - MOST_BYTES;
    if (over > 0) {
      setText(this.why, `${over} bytes too long: say it in two messages.`);
      return;
    }
    field.value = '';
    this.carries = false;
    setText(this.why, '');
    const { sessionId, clients } = session;
    try {
      await clients.talk.say({ sessionId, requestId: newUuid(), text, annotationId }, TIMEOUT);
    } catch (error) {
      if (field.value === '') field.value = text; // nothing that was typed is lost
      setText(this.why, `Not said. ${plainWords(error)}`);
    }
  }

  update(): void {
    const { session, state, open } = this;
    const { messages, version } = session.talk;
    this.voice.update();
    const shown = open || state.sheet === 'talk';
    if (!this.began && version > 0) this.seen = messages.at(-1)?.number ?? 0;
    this.began ||= version > 0;
    const last = messages.at(-1);
    if (last && last.number < this.seen) this.seen = 0; // another server's conversation
    if (shown && document.hasFocus()) this.seen = last?.number ?? 0;
    const mark = state.selectedId ? session.annotations.get(state.selectedId) : undefined;
    if (!mark) this.carries = false;
    const { unread } = this;
    const key = [
      version,
      session.annotations.version,
      shown,
      unread,
      mark?.id,
      this.carries,
    ].join();
    if (key === this.drawn) return;
    this.drawn = key;
    setClass(this.element, 'open', open);
    setClass(this.body, 'folded', !open);
    this.head.setAttribute('aria-expanded', String(shown));
    setText(this.count, unread > 0 ? `${unread} new` : '');
    setText(this.latest, !open && last ? messageWords(last, this.markOf(last)) : '');
    setClass(this.chip, 'hidden', !mark);
    setClass(this.chip, 'on', this.carries);
    setText(this.chip, mark ? `${this.carries ? '✓' : '+'} ${titleOf(mark)}` : '');
    this.chip.title = 'Look here: the selected mark goes with the message';
    this.chip.setAttribute('aria-pressed', String(this.carries));
    this.updateRows(messages);
  }

  private markOf(message: ChatMessage): ReturnType<Session['annotations']['get']> {
    return this.session.annotations.get(message.annotationId);
  }

  private updateRows(messages: readonly ChatMessage[]): void {
    const present = new Set(messages.map(({ number }) => number));
    for (const [number, row] of this.rows) {
      if (present.has(number)) continue;
      row.remove();
      this.rows.delete(number);
    }
    const { log } = this;
    const atEnd = log.scrollHeight - log.scrollTop - log.clientHeight < 40;
    for (const message of messages) {
      const row = this.rows.get(message.number) ?? this.addRow(message);
      const look = row.querySelector<HTMLButtonElement>('button');
      if (!look) continue;
      const mark = this.markOf(message);
      setText(look, mark ? `look here: ${titleOf(mark)}` : 'the mark is gone');
      look.disabled = !mark;
    }
    if (atEnd) log.scrollTop = log.scrollHeight;
  }

  private addRow(message: ChatMessage): HTMLElement {
    const { number, name, text, sentMs, annotationId, participantId } = message;
    const mine = participantId === this.session.participantId;
    const row = h(
      'li',
      { 'data-number': String(number), class: mine ? 'mine' : '' },
      h('span', { class: 'who' }, mine ? 'you' : name),
      h('time', { class: 'number' }, clockWords(sentMs)),
      h('p', { dir: 'auto' }, text),
    );
    if (annotationId) {
      const look = h('button', { type: 'button', class: 'look-here', 'data-mark': annotationId });
      look.addEventListener('click', () => this.show(annotationId));
      row.append(look);
    }
    this.rows.set(number, row);
    this.list.append(row);
    return row;
  }
}
