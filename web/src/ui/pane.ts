import { projectPolyline } from '../geometry/polyline';
import type { Pixel } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { axisStrokes, colourOf, type Mark, pictureGrid, strokesOf } from '../scene/strokes';
import { pageNowMs } from '../session/clock';
import type { Session } from '../session/session';
import { handleOf } from '../tools/handle';
import { landingWords, lyingRing, ringRadius } from '../tools/landing';
import type { AppState, Hover, PaneName } from './app_state';
import { h, setText } from './dom';
import { targetLabel } from './gaze_words';
import type { ShownPicture } from './mark_painter';
import { allMarks } from './marks';
import { Painter } from './painter';
import type { PictureCache } from './picture_cache';
import type { Player } from './player';
import { type PictureRect, PointerLayer, type ShownPointer } from './pointer_layer';
import { dated } from './words';

const SMALL_PICTURE_PX = 90; // below, a picture is flat enough for one cell
const CELLS = 4;

/** What the map and the video share: a picture, the same marks above it, and a line of words. */
export abstract class Pane {
  readonly element: HTMLElement;
  /** CSS px. Told by the browser, not asked for: asking would have it lay out the page in each frame. */
  protected size = { width: 0, height: 0 };
  /** How long drawing over the picture took [ms], of the last frames. */
  readonly overlayMs: number[] = [];
  protected readonly painter = new Painter();
  private readonly pointers = new PointerLayer();
  private readonly note = h('p', { class: 'pane-note', role: 'status' });
  private cached: { readonly key: string; readonly marks: readonly Mark[] } | undefined;

  constructor(
    private readonly name: PaneName,
    words: { readonly className: string; readonly label: string; readonly title: string },
    canvases: readonly HTMLElement[],
    protected readonly session: Session,
    protected readonly player: Player,
    readonly state: AppState,
    private readonly pictures: PictureCache,
  ) {
    this.element = h(
      'section',
      { class: `pane ${words.className}`, 'aria-label': words.label, tabindex: '0' },
      ...canvases,
      this.painter.canvas,
      this.pointers.canvas,
      h('h2', { class: 'pane-title' }, words.title),
      this.note,
    );
    new ResizeObserver(([entry]) => {
      if (!entry) return;
      const { width, height } = entry.contentRect;
      this.size = { width, height };
      state.moved();
    }).observe(this.element);
  }

  abstract view(): View | undefined;

  /** Where the view lies in the pane. */
  protected abstract layout(): PictureRect;

  /** What people point at and draw now: with each screen frame, and the moment something is heard. */
  drawPointers(): void {
    const view = this.view();
    this.pointers.draw(view ? this.shownPointers(view) : [], this.size, this.layout());
  }

  /** CSS pixels of the pane. */
  get shape(): { readonly width: number; readonly height: number } {
    return this.size;
  }

  protected setNote(text: string): void {
    setText(this.note, text);
  }

  /** Those whose row is selected or pointed at. */
  protected get accented(): readonly (string | undefined)[] {
    return [...this.state.selection, this.state.pointedId];
  }

  /** What is drawn, the same until something of it changes. */
  marks(): readonly Mark[] {
    const { session, state } = this;
    const key = `${session.annotations.version} ${state.drawn} ${session.scale.metric}`;
    if (this.cached?.key === key) return this.cached.marks;
    const marks = allMarks(session.annotations, session.scale, (each) => state.draws(each));
    this.cached = { key, marks };
    return marks;
  }

  /** Axes and every mark in `view`, and what people do there; returns the marks. */
  protected drawMarks(view: View): readonly Mark[] {
    const marks = this.marks();
    const { painter, accented } = this;
    painter.axes(axisStrokes(view));
    painter.pictures(this.shownPictures(view, marks));
    painter.marks(strokesOf(view, marks, accented), accented);
    const handle = handleOf(view, this.turnable(marks));
    if (handle) painter.handle(handle);
    const { area } = this.state;
    if (area?.pane === this.name) painter.area(area.from, area.to);
    return marks;
  }

  /** The one mark that its handle would turn. */
  turnable(marks: readonly Mark[] = this.marks()): Mark | undefined {
    const { selection, selectedId, tool } = this.state;
    if (tool !== 'select' || selection.size !== 1) return undefined;
    const mark = marks.find(({ id }) => id === selectedId);
    return mark?.shape === 'arrow' || mark?.shape === 'box' ? mark : undefined;
  }

  protected shownPictures(view: View, marks: readonly Mark[]): ShownPicture[] {
    const shown: ShownPicture[] = [];
    for (const mark of marks) {
      if (mark.shape !== 'picture' || mark.hollow) continue; // not trusted: its outline alone
      const annotation = this.session.annotations.get(mark.id);
      const image = annotation && this.pictures.get(annotation);
      if (!image) continue;
      const [[a, b] = []] = pictureGrid(view, mark, 1);
      const small = a && b && Math.abs(a.u - b.u) < SMALL_PICTURE_PX;
      shown.push({ image, grid: pictureGrid(view, mark, small ? 1 : CELLS) });
    }
    return shown;
  }

  /** Where others point, what they draw, and this person's own laser. */
  private shownPointers(view: View): ShownPointer[] {
    const shown: ShownPointer[] = [];
    for (const { kind, name, colorRgba, points } of this.session.pointers.list(pageNowMs())) {
      const last = points.at(-1);
      const at = last && projectPoint(view, last);
      if (!at) continue;
      const pieces = projectPolyline(view.camera, view.cameraFromWorld, points);
      shown.push({ kind, pieces, at, colour: colourOf({ colorRgba }), name });
    }
    const { laser } = this.state;
    const at = laser && projectPoint(view, laser.pointInWorld);
    if (at) shown.push({ kind: 'laser', pieces: [], at, colour: colourOf(laser), name: '' });
    return shown;
  }

  /** Keeps how long one drawing took. */
  protected took(ms: number): void {
    this.overlayMs.push(ms);
    if (this.overlayMs.length > 120) this.overlayMs.shift();
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
    const words = dated(hover.words ?? landingWords(view, hover.landing, scale.metric), ageMs);
    const { landing } = hover;
    const lies = landing.how === 'surface';
    const lines = (times: number): readonly (readonly Pixel[])[] => {
      const ring = lyingRing(landing, times);
      const { camera, cameraFromWorld } = view;
      const each = ring ? [ring.rim, ring.pin] : [];
      return each.flatMap((points) => projectPolyline(camera, cameraFromWorld, points));
    };
    this.painter.ring(pixel, ringRadius(view, landing), words, lies ? lines : undefined);
  }
}
