import { colourOf } from '../scene/strokes';
import { markWords } from '../scene/label_words';
import type { Annotation } from '../session/types';
import type { AnnotationActions } from './annotations_panel';
import { h, icon, setAttribute, setClass, setText } from './dom';
import { ICONS } from './icons';
import { shapeWord } from './words';

/** What a row shows beside the annotation itself. */
export interface RowFacts {
  readonly selected: boolean;
  readonly state: string;
  readonly warn: boolean;
  readonly metric: boolean;
  /** The author's, 0xRRGGBBAA; undefined: not known here. */
  readonly authorColour: number | undefined;
}

/** One mark of the list: what it says, who made it, its state, and what can be done with it. */
export class AnnotationRow {
  readonly element: HTMLElement;
  private readonly title = h('span', { class: 'title', dir: 'auto' });
  private readonly state = h('span', { class: 'state number' });
  private readonly by = h('span', { class: 'by' });
  private readonly person = h('span', { class: 'person', 'aria-hidden': 'true' });
  private readonly name = h('span', {});
  private readonly locked = h('span', { class: 'locked hidden', title: 'locked' });
  private readonly button: HTMLButtonElement;
  private readonly items = h('div', { class: 'items', role: 'group', 'aria-label': 'To be done' });
  private readonly boxes: { box: HTMLInputElement; text: HTMLElement; by: HTMLElement }[] = [];
  private shown = '';

  constructor(
    { id, shape }: Annotation,
    private readonly actions: AnnotationActions,
  ) {
    this.locked.append(icon(ICONS.lock));
    this.locked.setAttribute('role', 'img');
    this.locked.setAttribute('aria-label', 'locked');
    this.by.append(this.locked, this.person, this.name);
    this.button = h(
      'button',
      { class: 'pick', type: 'button' },
      icon(ICONS[shape]),
      h('span', { class: 'words' }, this.title, this.by, this.state),
    );
    this.button.addEventListener('click', (event) => {
      actions.select(id, event.shiftKey || event.ctrlKey || event.metaKey);
    });
    this.button.addEventListener('dblclick', () => actions.startEditing(id));
    const remove = h('button', { class: 'remove', type: 'button', title: 'Delete (Del)' });
    remove.setAttribute('aria-label', `Delete ${shapeWord(shape)}`);
    remove.append(icon('M5.5 5.5l9 9M14.5 5.5l-9 9'));
    remove.addEventListener('click', () => actions.remove(id));
    const look = h('button', { class: 'look', type: 'button', title: 'Turn the camera to it' });
    look.setAttribute('aria-label', `Turn the camera to this ${shapeWord(shape)}`);
    look.append(icon(ICONS.gaze));
    look.addEventListener('click', () => actions.lookAt(id));
    const attributes = { 'data-id': id, 'data-shape': shape };
    this.element = h('li', attributes, this.button, look, remove);
    if (shape === 'check_list') this.element.append(this.items);
    this.element.addEventListener('pointerenter', () => actions.point(id));
    this.element.addEventListener('pointerleave', () => actions.point(undefined));
  }

  /** Touches the page only where something shown has changed. */
  update(annotation: Annotation, facts: RowFacts): void {
    const { selected, state, warn, metric, authorColour } = facts;
    const { shape, author, locked, checkItems } = annotation;
    const words = titleOf(annotation, metric);
    const colour = colourOf(annotation);
    const key = JSON.stringify([words, author, locked, checkItems, colour, facts]);
    if (key === this.shown) return;
    this.shown = key;
    const { element, button } = this;
    setText(this.title, words);
    setText(this.state, state);
    setText(this.name, author);
    setClass(this.locked, 'hidden', !locked);
    setClass(this.person, 'hidden', authorColour === undefined);
    if (authorColour !== undefined) {
      this.person.style.setProperty('--person', colourOf({ colorRgba: authorColour }));
    }
    const chosen = selected && !element.classList.contains('selected');
    setClass(element, 'warn', warn);
    setClass(element, 'selected', selected);
    if (chosen) element.scrollIntoView({ block: 'nearest' });
    element.style.setProperty('--mark', colour);
    setAttribute(button, 'aria-pressed', String(selected));
    const all = [
      annotation.text,
      `${shapeWord(shape)} by ${author}`,
      locked ? 'locked' : '',
      state,
    ];
    button.title = all.filter(Boolean).join('\n');
    if (shape === 'check_list') this.updateItems(annotation);
  }

  private updateItems({ id, checkItems }: Annotation): void {
    for (let i = this.boxes.length; i < checkItems.length; ++i) this.addItem(id, i);
    checkItems.forEach((item, i) => {
      const row = this.boxes[i];
      if (!row) return;
      row.box.checked = item.done;
      setText(row.text, item.text);
      setText(row.by, item.done && item.doneBy ? item.doneBy : '');
    });
  }

  private addItem(id: string, index: number): void {
    const box = h('input', { type: 'checkbox' });
    const text = h('span', { class: 'text', dir: 'auto' });
    const by = h('span', { class: 'done-by' });
    box.addEventListener('change', () => {
      const { checked } = box;
      box.checked = !checked; // until the server has it so
      this.shown = '';
      this.actions.tick(id, index, checked);
    });
    this.items.append(h('label', {}, box, text, by));
    this.boxes.push({ box, text, by });
  }
}

/** One line: what its label says first. */
function titleOf(annotation: Annotation, metric: boolean): string {
  const [first = ''] = markWords(annotation, metric).split('\n');
  const { shape, text } = annotation;
  if (shape === 'note') return text || 'note';
  return shape === 'pin' ? `pin ${first}` : first || shapeWord(shape);
}
