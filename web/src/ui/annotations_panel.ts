import { colourOf } from '../scene/strokes';
import type { Annotation } from '../session/types';
import type { Session } from '../session/session';
import { isFiltering } from '../tools/mark_filter';
import type { MarkCommandName } from '../tools/tools';
import type { AppState } from './app_state';
import { h, icon, setClass, setText } from './dom';
import { ICONS } from './icons';
import { MarksBar } from './marks_bar';
import { Palette } from './palette';
import { anchorWords, dated, shapeWord } from './words';

export interface AnnotationActions {
  select(id: string): void;
  /** Shows which mark a row means; undefined: none. */
  point(id: string | undefined): void;
  remove(id: string): void;
  /** Turns the camera to it. */
  lookAt(id: string): void;
  /** The colour of new marks, and of the selected one: 0xRRGGBBAA. */
  paint(colorRgba: number): void;
  startEditing(id: string): void;
  runMarks(command: MarkCommandName): void;
}

const NONE =
  'None yet. Choose a cube (C), note (N) or arrow (A), then click in the map or the video.';

interface Row {
  readonly element: HTMLElement;
  readonly title: HTMLElement;
  readonly state: HTMLElement;
  readonly by: HTMLElement;
  readonly button: HTMLElement;
}

/** Every annotation with its state and live error. */
export class AnnotationsPanel {
  readonly element: HTMLElement;
  private readonly count = h('span', { class: 'number' });
  private readonly list = h('ul', {});
  private readonly empty = h('p', { class: 'empty' });
  private readonly rows = new Map<string, Row>();
  private readonly palette: Palette;
  readonly bar: MarksBar;

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly actions: AnnotationActions,
    editor: HTMLElement,
  ) {
    this.palette = new Palette((colour) => actions.paint(colour));
    this.bar = new MarksBar(state, (command) => actions.runMarks(command));
    this.element = h(
      'aside',
      { 'aria-label': 'Annotations' },
      h('h2', {}, 'Annotations', this.count),
      this.palette.element,
      this.bar.element,
      editor,
      this.empty,
      this.list,
    );
  }

  update(): void {
    const all = this.session.annotations.list();
    const annotations = all.filter((annotation) => this.state.lists(annotation));
    const some = isFiltering(this.state.filter) ? `${annotations.length} of ` : '';
    setText(this.count, `${some}${all.length}`);
    this.bar.update();
    setText(this.empty, all.length === 0 ? NONE : 'None of the marks is like that.');
    this.palette.update(this.state.colorRgba);
    setClass(this.empty, 'hidden', annotations.length > 0);
    const present = new Set(annotations.map(({ id }) => id));
    for (const [id, row] of this.rows) {
      if (present.has(id)) continue;
      row.element.remove();
      this.rows.delete(id);
    }
    for (const annotation of annotations) this.updateRow(annotation);
  }

  private updateRow(annotation: Annotation): void {
    const row = this.rows.get(annotation.id) ?? this.addRow(annotation);
    const selected = annotation.id === this.state.selectedId;
    const { text, warn } = anchorWords(annotation, this.session.scale);
    const words = { text: dated(text, this.session.ageMs), warn };
    const refusal = this.state.refusal(`annotation ${annotation.id}`);
    setText(row.title, annotation.text || shapeWord(annotation.shape));
    setText(row.state, refusal ?? words.text);
    const provisional = annotation.anchor.state === 'provisional';
    setText(row.by, provisional ? 'provisional' : annotation.author);
    setClass(row.element, 'warn', words.warn || refusal !== undefined);
    const chosen = selected && !row.element.classList.contains('selected');
    setClass(row.element, 'selected', selected);
    if (chosen) row.element.scrollIntoView({ block: 'nearest' });
    row.element.style.setProperty('--mark', colourOf(annotation));
    row.button.setAttribute('aria-pressed', String(selected));
    row.button.title = titleOf(annotation, words.text);
  }

  private addRow(annotation: Annotation): Row {
    const { id, shape } = annotation;
    const title = h('span', { class: 'title', dir: 'auto' });
    const state = h('span', { class: 'state number' });
    const by = h('span', { class: 'by' });
    const button = h(
      'button',
      { class: 'pick', type: 'button' },
      icon(ICONS[shape === 'ink' ? 'arrow' : shape]),
      h('span', { class: 'words' }, title, by, state),
    );
    button.addEventListener('click', () => this.actions.select(id));
    button.addEventListener('dblclick', () => this.actions.startEditing(id));
    const remove = h('button', { class: 'remove', type: 'button', title: 'Delete (Del)' });
    remove.setAttribute('aria-label', `Delete ${shapeWord(shape)}`);
    remove.append(icon('M5.5 5.5l9 9M14.5 5.5l-9 9'));
    remove.addEventListener('click', () => this.actions.remove(id));
    const look = h('button', { class: 'look', type: 'button', title: 'Turn the camera to it' });
    look.setAttribute('aria-label', `Turn the camera to this ${shapeWord(shape)}`);
    look.append(icon(ICONS.gaze));
    look.addEventListener('click', () => this.actions.lookAt(id));
    const element = h('li', { 'data-id': id, 'data-shape': shape }, button, look, remove);
    element.addEventListener('pointerenter', () => this.actions.point(id));
    element.addEventListener('pointerleave', () => this.actions.point(undefined));
    this.list.append(element);
    const row: Row = { element, title, state, by, button };
    this.rows.set(id, row);
    return row;
  }
}

/** All of it, whatever the row has room for. */
const titleOf = ({ shape, author, text }: Annotation, state: string): string =>
  [text, `${shapeWord(shape)} by ${author}`, state].filter(Boolean).join('\n');
