import type { Pixel } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { axisStrokes, type Mark, strokesOf } from '../scene/strokes';
import type { Session } from '../session/session';
import { landingWords, ringRadius } from '../tools/landing';
import type { AppState, Hover, PaneName } from './app_state';
import { h, setText } from './dom';
import { targetLabel } from './gaze_words';
import { allMarks } from './marks';
import { Painter } from './painter';
import type { Player } from './player';
import { dated } from './words';

/** What the map and the video share: a picture, the same marks above it, and a line of words. */
export abstract class Pane {
  readonly element: HTMLElement;
  protected readonly painter = new Painter();
  private readonly note = h('p', { class: 'pane-note', role: 'status' });

  constructor(
    private readonly name: PaneName,
    words: { readonly className: string; readonly label: string; readonly title: string },
    pictures: readonly HTMLElement[],
    protected readonly session: Session,
    protected readonly player: Player,
    protected readonly state: AppState,
  ) {
    this.element = h(
      'section',
      { class: `pane ${words.className}`, 'aria-label': words.label, tabindex: '0' },
      ...pictures,
      this.painter.canvas,
      h('h2', { class: 'pane-title' }, words.title),
      this.note,
    );
  }

  protected setNote(text: string): void {
    setText(this.note, text);
  }

  /** Those whose row is selected or pointed at. */
  protected get accented(): readonly (string | undefined)[] {
    return [this.state.selectedId, this.state.pointedId];
  }

  protected marks(): Mark[] {
    const { session, state } = this;
    return allMarks(session.annotations, session.scale, (annotation) => state.draws(annotation));
  }

  /** Axes and every mark in `view`; returns the marks. */
  protected drawMarks(view: View): readonly Mark[] {
    const marks = this.marks();
    this.painter.axes(axisStrokes(view));
    this.painter.marks(strokesOf(view, marks), this.accented);
    return marks;
  }

  /** The fixation target where it appears at `at`; what was asked for until the server answers. */
  protected drawTarget(view: View, at: Pixel | undefined): void {
    const { gaze } = this.session;
    const asked = this.state.askedInWorld;
    const askedAt = asked && projectPoint(view, asked);
    if (askedAt) this.painter.target(askedAt, false, 'asking');
    else if (gaze && at) this.painter.target(at, gaze.arrived, targetLabel(gaze));
  }

  /** Where a click would land, if the pointer is over this pane: `at` says where to draw that. */
  protected drawLanding(view: View, at: (hover: Hover, view: View) => Pixel | undefined): void {
    const { hover } = this.state;
    if (hover?.pane !== this.name || !hover.landing) return;
    const pixel = at(hover, view);
    if (!pixel) return;
    const { scale, ageMs } = this.session;
    const words = dated(landingWords(view, hover.landing, scale.metric), ageMs);
    this.painter.ring(pixel, ringRadius(view, hover.landing), words);
  }
}
