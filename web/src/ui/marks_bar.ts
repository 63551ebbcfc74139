import { type Control, MARK_COMMANDS, type MarkCommandName } from '../tools/tools';
import type { AppState } from './app_state';
import { h, icon, setClass, setText } from './dom';
import { ICONS } from './icons';

/** Above the list: find marks, only mine, hide them all, keep a picture with them. */
export class MarksBar {
  readonly element: HTMLElement;
  private readonly field = h('input', {
    class: 'find',
    type: 'search',
    placeholder: 'Find marks',
    'aria-label': 'Find marks by text, shape or author',
  });
  private readonly buttons = new Map<MarkCommandName, HTMLButtonElement>();
  private readonly reason = h('p', { class: 'why', role: 'alert' });

  constructor(
    private readonly state: AppState,
    run: (command: MarkCommandName) => void,
  ) {
    this.field.addEventListener('input', () => this.filter(this.field.value));
    this.field.addEventListener('keydown', ({ key }) => {
      if (key === 'Escape') this.filter('');
      if (key === 'Escape' || key === 'Enter') this.field.blur();
    });
    const row = h('div', { class: 'find-row' }, this.field);
    for (const control of MARK_COMMANDS) {
      const button = makeButton(control);
      button.addEventListener('click', () => run(control.name));
      this.buttons.set(control.name, button);
      row.append(button);
    }
    this.element = h('div', { class: 'marks-bar' }, row, this.reason);
  }

  private filter(text: string): void {
    this.field.value = text;
    this.state.filter = { ...this.state.filter, text };
    this.state.changed();
  }

  /** The keyboard goes to the field. */
  focus(): void {
    this.field.focus();
    this.field.select();
  }

  update(): void {
    const { filter, hideMarks, hidden } = this.state;
    for (const [name, on] of [
      ['mine', filter.mine],
      ['hide', hideMarks || hidden.size > 0],
    ] as const) {
      const button = this.buttons.get(name);
      if (!button) continue;
      setClass(button, 'on', on);
      button.setAttribute('aria-pressed', String(on));
    }
    setText(this.reason, this.state.refusal('snapshot') ?? '');
  }
}

function makeButton({ name, label, hint, shown }: Control<MarkCommandName>): HTMLButtonElement {
  const button = h(
    'button',
    {
      type: 'button',
      'data-control': name,
      'aria-label': label,
      title: `${label}: ${hint} (${shown})`,
    },
    icon(ICONS[name]),
  );
  button.setAttribute('aria-keyshortcuts', shown);
  return button;
}
