import { type CommandName, COMMANDS, type Control, type ToolName, TOOLS } from '../tools/tools';
import type { AppState } from './app_state';
import { beside } from './beside';
import { h, icon, setAttribute, setClass, setText } from './dom';
import { ICONS } from './icons';

export interface ToolActions {
  choose(tool: ToolName): void;
  run(command: CommandName): void;
  confirmReset(really: boolean): void;
}

/** Tools at the left, one key each; why something cannot be done stands beside its button. */
export class ToolsColumn {
  readonly element = h('nav', { 'aria-label': 'Tools' });
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private readonly reasons = new Map<ToolName | CommandName, HTMLElement>();
  private readonly hints = new Map<ToolName | CommandName, HTMLElement>();
  private readonly confirm: HTMLElement;

  constructor(private readonly actions: ToolActions) {
    for (const tool of TOOLS) this.add(tool, () => actions.choose(tool.name));
    this.element.append(h('hr'));
    for (const command of COMMANDS) {
      if (command.name === 'reset') this.element.append(h('span', { class: 'space' }));
      this.add(command, () => actions.run(command.name));
    }
    this.confirm = this.makeConfirm();
    this.buttons.get('reset')?.parentElement?.append(this.confirm);
  }

  private add(control: Control<ToolName | CommandName>, act: () => void): void {
    const button = h(
      'button',
      {
        ...{ type: 'button', 'data-control': control.name, 'aria-label': control.label },
        'aria-keyshortcuts': control.shown.replace('^', 'Control+').replace('Del', 'Delete'),
      },
      icon(ICONS[control.name]),
      h('kbd', {}, control.shown),
    );
    button.addEventListener('click', act);
    this.buttons.set(control.name, button);
    const hint = h('span', {}, control.hint);
    const tip = h('span', { class: 'tip', role: 'tooltip' }, h('b', {}, control.label), hint);
    this.hints.set(control.name, hint);
    for (const event of ['pointerenter', 'focus'] as const) {
      button.addEventListener(event, () => beside(tip, button));
    }
    const reason = h('span', { class: 'reason', role: 'alert' });
    this.reasons.set(control.name, reason);
    this.element.append(h('div', { class: 'tool' }, button, tip, reason));
  }

  private makeConfirm(): HTMLElement {
    const yes = h('button', { type: 'button', class: 'danger' }, 'Reset');
    const no = h('button', { type: 'button' }, 'Keep (Esc)');
    yes.addEventListener('click', () => this.actions.confirmReset(true));
    no.addEventListener('click', () => this.actions.confirmReset(false));
    return h(
      'div',
      { class: 'confirm hidden', role: 'group', 'aria-label': 'Reset the map?' },
      h('p', {}, 'Forget the map? Marks stay, paused, until their place is known again.'),
      yes,
      no,
    );
  }

  /** `on`: which of the commands that stay on are; `whyNot`: why one cannot be used at all. */
  update(
    state: AppState,
    on: Partial<Record<CommandName, boolean>>,
    whyNot: (name: ToolName | CommandName) => string | undefined,
  ): void {
    for (const { name } of TOOLS) {
      const button = this.buttons.get(name);
      if (!button) continue;
      setClass(button, 'current', state.tool === name);
      setAttribute(button, 'aria-pressed', String(state.tool === name));
    }
    for (const { name } of [...TOOLS, ...COMMANDS]) {
      const why = whyNot(name);
      const button = this.buttons.get(name);
      if (!button) continue;
      setAttribute(button, 'aria-disabled', String(why !== undefined));
      const hint = this.hints.get(name);
      if (hint) setText(hint, why ?? hintOf(name));
    }
    for (const [name, isOn] of Object.entries(on)) {
      const button = this.buttons.get(name);
      if (!button) continue;
      setClass(button, 'on', isOn);
      setAttribute(button, 'aria-pressed', String(isOn));
    }
    for (const [name, element] of this.reasons) {
      setText(element, state.refusal(name) ?? '');
      this.putBeside(element, name);
    }
    const opening = state.confirmingReset && this.confirm.classList.contains('hidden');
    setClass(this.confirm, 'hidden', !state.confirmingReset);
    if (state.confirmingReset) this.putBeside(this.confirm, 'reset');
    if (opening) this.confirm.querySelector<HTMLButtonElement>('button:last-child')?.focus();
  }

  private putBeside(words: HTMLElement, name: string): void {
    const button = this.buttons.get(name);
    if (button && words.textContent !== '') beside(words, button);
  }
}

const hintOf = (name: ToolName | CommandName): string =>
  [...TOOLS, ...COMMANDS].find((control) => control.name === name)?.hint ?? '';
