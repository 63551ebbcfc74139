import type { AppState, SheetName } from './app_state';
import { h, setText } from './dom';

/** Opens the panels, one at a time, where there is no room for them beside the picture. */
export class Sheets {
  readonly element = h('div', { class: 'sheets', role: 'group', 'aria-label': 'Panels' });
  private readonly buttons = new Map<SheetName, HTMLButtonElement>();

  constructor(private readonly state: AppState) {
    this.add('marks', 'Marks');
    this.add('gaze', 'Gaze');
    this.add('talk', 'Talk');
  }

  private add(name: SheetName, words: string): void {
    const button = h('button', { type: 'button', 'data-sheet': name }, words);
    button.addEventListener('click', () => {
      this.state.sheet = this.state.sheet === name ? undefined : name;
      this.state.changed();
    });
    this.buttons.set(name, button);
    this.element.append(button);
  }

  update(marks: number, unread: number): void {
    for (const [name, button] of this.buttons) {
      button.setAttribute('aria-expanded', String(this.state.sheet === name));
    }
    const [list, talk] = [this.buttons.get('marks'), this.buttons.get('talk')];
    if (list) setText(list, `Marks ${marks}`);
    if (talk) setText(talk, unread > 0 ? `Talk ${unread}` : 'Talk');
  }
}
