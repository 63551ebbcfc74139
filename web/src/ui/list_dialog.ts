import { bytesOf, cleanText, MAX_TEXT_BYTES } from '../tools/note_text';
import { reasonOf } from './attempt';
import { h, setText } from './dom';

export interface WrittenList {
  readonly text: string;
  readonly items: readonly string[];
}

const MAX_ITEMS = 30; // annotation.proto
const MAX_ITEM_BYTES = 100;

/** What of a list cannot be kept, in words; empty: nothing. */
export function problemOf({ text, items }: WrittenList): string {
  if (items.length === 0) return 'Write at least one line.';
  if (items.length > MAX_ITEMS) return `${items.length} lines, and at most ${MAX_ITEMS} are kept.`;
  const long = items.findIndex((item) => bytesOf(item) > MAX_ITEM_BYTES);
  if (long >= 0) {
    const bytes = bytesOf(items[long] ?? '');
    return `Line ${long + 1} has ${bytes} bytes, and at most ${MAX_ITEM_BYTES} are kept: shorten it.`;
  }
  const over = bytesOf(text) - MAX_TEXT_BYTES;
  return over > 0 ? `The title is ${over} bytes too long: shorten it.` : '';
}

/** Writes a check list: a title, and a line for each thing to do. */
export class ListDialog {
  readonly dialog: HTMLDialogElement;
  private readonly title = h('input', {
    id: 'list-title',
    type: 'text',
    dir: 'auto',
    autocomplete: 'off',
  });
  private readonly lines = h('textarea', { id: 'list-lines', rows: '6', dir: 'auto' });
  private readonly problem = h('p', { class: 'problem', role: 'alert' });
  private keep: (() => void) | undefined;

  constructor() {
    const place = h('button', { type: 'submit', class: 'main' }, 'Place it (Ctrl Enter)');
    const cancel = h('button', { type: 'button' }, 'Cancel (Esc)');
    cancel.addEventListener('click', () => this.dialog.close());
    const form = h(
      'form',
      { method: 'dialog' },
      h('label', { for: 'list-title' }, 'Title'),
      this.title,
      h('label', { for: 'list-lines' }, 'What is to be done, a line each'),
      this.lines,
      this.problem,
      h('div', { class: 'buttons' }, place, cancel),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.keep?.();
    });
    this.dialog = h(
      'dialog',
      { 'aria-labelledby': 'list-heading', class: 'asks' },
      h('h2', { id: 'list-heading' }, 'Check list'),
      form,
    );
    this.dialog.addEventListener('keydown', (event) => {
      if (event.key === 'Enter' && (event.ctrlKey || event.metaKey)) this.keep?.();
    });
  }

  /** Resolves once it is closed; `place` is tried until it is kept or given up. */
  ask(place: (list: WrittenList) => Promise<void>): Promise<void> {
    this.title.value = this.lines.value = '';
    setText(this.problem, '');
    this.dialog.showModal();
    this.title.focus();
    this.keep = () => void this.send(place);
    return new Promise((resolve) =>
      this.dialog.addEventListener('close', () => resolve(), { once: true }),
    );
  }

  private async send(place: (list: WrittenList) => Promise<void>): Promise<void> {
    const items = this.lines.value.split('\n').map(cleanText).filter(Boolean);
    const list = { text: cleanText(this.title.value), items };
    const problem = problemOf(list);
    setText(this.problem, problem);
    if (problem) return;
    this.keep = undefined; // once
    try {
      await place(list);
      this.dialog.close();
    } catch (error) {
      setText(this.problem, `Not placed: ${reasonOf(error)}. Try again.`);
      this.keep = () => void this.send(place);
    }
  }
}
