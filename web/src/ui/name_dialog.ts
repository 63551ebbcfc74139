import { bytesOf } from '../tools/note_text';
import { cleanName, MAX_NAME_BYTES } from '../session/name';
import { h, setText } from './dom';

/** Asks once what the others should call this person; the header's field changes it later. */
export class NameDialog {
  readonly dialog: HTMLDialogElement;
  private readonly field = h('input', {
    id: 'own-name',
    type: 'text',
    autocomplete: 'nickname',
    dir: 'auto',
  });
  private readonly problem = h('p', { class: 'problem', role: 'alert' });

  /** `named` hears the name, or the one that is there if none was given. */
  constructor(
    private readonly before: string,
    private readonly named: (name: string) => void,
  ) {
    const form = h(
      'form',
      { method: 'dialog' },
      h('label', { for: 'own-name' }, 'Your name, as the others see it at your marks'),
      this.field,
      this.problem,
      h(
        'div',
        { class: 'buttons' },
        h('button', { type: 'submit', class: 'main' }, 'Go on (Enter)'),
      ),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      const over = bytesOf(this.field.value.trim()) - MAX_NAME_BYTES;
      setText(this.problem, over > 0 ? `${over} bytes too long: shorten it.` : '');
      if (over <= 0) this.dialog.close();
    });
    this.dialog = h(
      'dialog',
      { 'aria-labelledby': 'name-heading', class: 'asks small' },
      h('h2', { id: 'name-heading' }, 'Who are you?'),
      form,
    );
    this.dialog.addEventListener('close', () => {
      this.named(cleanName(this.field.value) || this.before);
      this.dialog.remove();
    });
  }

  ask(): void {
    this.dialog.showModal();
    this.field.focus();
  }
}
