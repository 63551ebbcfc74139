import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import { isFiltering } from '../tools/mark_filter';
import type { MarkCommandName } from '../tools/tools';
import { AnnotationRow } from './annotation_row';
import type { AppState } from './app_state';
import { h, setClass, setText } from './dom';
import { MarksBar } from './marks_bar';
import { Palette } from './palette';
import { anchorWords, dated } from './words';

export interface AnnotationActions {
  /** `adds`: to those selected, or from them. */
  select(id: string, adds: boolean): void;
  /** Shows which mark a row means; undefined: none. */
  point(id: string | undefined): void;
  remove(id: string): void;
  /** Turns the camera to it. */
  lookAt(id: string): void;
  /** The colour of new marks, and of the selected ones: 0xRRGGBBAA. */
  paint(colorRgba: number): void;
  startEditing(id: string): void;
  /** A line of a check list is done, or not. */
  tick(id: string, index: number, done: boolean): void;
  runMarks(command: MarkCommandName): void;
}

const NONE =
  'None yet. Choose a cube (C), note (N) or arrow (A), then click in the map or the video.';

/** Every annotation with its state and live error. */
export class AnnotationsPanel {
  readonly element: HTMLElement;
  private readonly count = h('span', { class: 'number' });
  private readonly list = h('ul', {});
  private readonly empty = h('p', { class: 'empty' });
  private readonly rows = new Map<string, AnnotationRow>();
  private readonly colours = new Map<string, number>(); // by person
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
    const { size } = this.state.selection;
    setText(this.count, `${size > 1 ? `${size} selected · ` : ''}${some}${all.length}`);
    this.bar.update();
    setText(this.empty, all.length === 0 ? NONE : 'None of the marks is like that.');
    this.palette.update(this.state.colorRgba);
    setClass(this.empty, 'hidden', annotations.length > 0);
    // Who has gone is still known by the colour of then.
    for (const { personId, colorRgba } of this.session.participants) {
      if (personId) this.colours.set(personId, colorRgba);
    }
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
    const { scale, ageMs } = this.session;
    const words = anchorWords(annotation, scale);
    const refusal = this.state.refusal(`annotation ${annotation.id}`);
    const hidden = this.state.hidden.has(annotation.id) ? 'hidden · ' : '';
    const provisional = annotation.anchor.state === 'provisional' ? 'provisional · ' : '';
    row.update(annotation, {
      selected: this.state.selection.has(annotation.id),
      state: refusal ?? `${hidden}${provisional}${dated(words.text, ageMs)}`,
      warn: words.warn || refusal !== undefined,
      metric: scale.metric,
      authorColour: this.colours.get(annotation.authorPersonId),
    });
  }

  private addRow(annotation: Annotation): AnnotationRow {
    const row = new AnnotationRow(annotation, this.actions);
    this.list.append(row.element);
    this.rows.set(annotation.id, row);
    return row;
  }
}
