import { controlOf } from '../tools/tools';
import { isComposing, isTextField, storage } from './dom';

const KEY = 'saccade.usedTools';

/** Icons have their names beside them until the person has used them. */
export class ToolNames {
  private readonly used: Set<string>;

  constructor(private readonly column: HTMLElement) {
    this.used = new Set((storage().getItem(KEY) ?? '').split(' ').filter(Boolean));
    for (const button of this.buttons) this.mark(button);
    column.addEventListener('click', ({ target }) => {
      const button = target instanceof Element ? target.closest('[data-control]') : null;
      this.use(button?.getAttribute('data-control') ?? '');
    });
    document.addEventListener('keydown', (event) => {
      if (isTextField(event.target) || isComposing(event)) return;
      this.use(controlOf(event) ?? '');
    });
  }

  private get buttons(): Iterable<Element> {
    return this.column.querySelectorAll('[data-control]');
  }

  private mark(button: Element): void {
    const name = button.getAttribute('data-control') ?? '';
    button.classList.toggle('unused', !this.used.has(name));
  }

  private use(name: string): void {
    if (name === '' || this.used.has(name)) return;
    this.used.add(name);
    for (const button of this.buttons) this.mark(button);
    try {
      storage().setItem(KEY, [...this.used].join(' '));
    } catch {
      // Full: then the names are there again.
    }
  }
}
