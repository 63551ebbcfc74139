import { roomWords } from '../tools/note_text';
import { h, isComposing, setClass, setText } from './dom';

export interface NoteEvents {
  /** Enter, or the keyboard goes elsewhere. */
  finish(): void;
  /** Escape. */
  cancel(): void;
}

/** The field a note is typed into: one for all notes, so that it is there at once. */
export class NoteEditor {
  readonly element: HTMLElement;
  private readonly input = h('textarea', {
    rows: '3',
    dir: 'auto',
    placeholder: 'what it says',
    'aria-label': 'Text of the note',
  });
  private readonly title = h('b', {});
  private readonly room = h('span', { class: 'number' });
  private readonly problem = h('p', { class: 'problem', role: 'alert' });

  constructor(private readonly events: NoteEvents) {
    this.element = h(
      'form',
      { class: 'note-editor hidden' },
      h('div', { class: 'line' }, this.title, this.room),
      this.input,
      this.problem,
      h('p', { class: 'keys' }, 'Enter keeps it, Esc discards'),
    );
    this.element.addEventListener('submit', (event) => event.preventDefault());
    this.input.addEventListener('input', () => this.count());
    this.input.addEventListener('keydown', (event) => {
      event.stopPropagation(); // letters are text here, not tools
      this.command(event);
    });
    this.input.addEventListener('focusout', ({ relatedTarget }) => {
      // To something else on this page, by Tab. Not when the window itself is left: typing goes on.
      const inside = relatedTarget instanceof Element && relatedTarget.closest(KEEPS_OPEN);
      if (this.isOpen && relatedTarget && !inside) this.events.finish();
    });
  }

  get isOpen(): boolean {
    return !this.element.classList.contains('hidden');
  }

  get text(): string {
    return this.input.value;
  }

  /** Takes the keyboard at once: the next key is text. */
  open(title: string, text: string, problem: string): void {
    setText(this.title, title);
    setClass(this.element, 'hidden', false);
    this.input.value = text;
    this.say(problem);
    this.count();
    this.focus();
  }

  say(problem: string): void {
    setText(this.problem, problem);
  }

  focus(): void {
    this.input.focus();
  }

  /** Lets go of the keyboard. */
  close(): void {
    setClass(this.element, 'hidden', true);
    this.input.blur();
    this.input.value = '';
  }

  /** A key that means the editor even where it has lost the focus; true if it was such a one. */
  command(event: KeyboardEvent): boolean {
    if (isComposing(event)) return false; // of the input method, not of this page
    if (event.key === 'Escape') this.events.cancel();
    else if (event.key !== 'Enter') return false;
    // Held down from before: the press that opened this, or the one that sent the last.
    else if (!event.repeat) this.events.finish();
    event.preventDefault();
    return true;
  }

  private count(): void {
    const { text, over } = roomWords(this.input.value);
    setText(this.room, text);
    setClass(this.room, 'over', over);
  }
}

/** Where a click leaves the note open: the colour is chosen for it. */
export const KEEPS_OPEN = '.note-editor, .palette';
