import { add, type Pixel, subtract, type Vec3, ZERO } from '../geometry/vec3';
import { projectPoint } from '../geometry/view';
import { type Change, type Edits } from '../session/edits';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import { newUuid } from '../session/uuid';
import type { Landing } from '../tools/landing';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import type { Drag } from './drag';

const STARTS_PX = 4; // CSS px: before, it is a click

/** Moves the selected marks with the one that was grabbed; of a measure the end that was grabbed. */
export class MoveDrag implements Drag {
  readonly clicks = true;
  private readonly offset: Pixel; // from the pointer to what was grabbed [view px]
  private readonly byEnd: boolean;
  private readonly from: Vec3;
  private landing: Landing | undefined;
  private started = false;
  private at: { x: number; y: number };

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    private readonly grabbed: Annotation,
    private readonly others: readonly Annotation[],
    private readonly press: { readonly x: number; readonly y: number },
  ) {
    this.at = press;
    const view = aim.view(pane);
    const pixel = aim.pixelAt(pane, press.x, press.y);
    const { pointInWorld = ZERO } = grabbed.anchor;
    const end = add(pointInWorld, grabbed.inkOffsetsM[0] ?? ZERO);
    const seen = (point: Vec3): Pixel | undefined => view && projectPoint(view, point);
    const away = (point: Vec3): number => {
      const place = seen(point);
      return place && pixel ? Math.hypot(place.u - pixel.u, place.v - pixel.v) : Infinity;
    };
    this.byEnd =
      grabbed.shape === 'measure' && others.length === 0 && away(end) < away(pointInWorld);
    this.from = this.byEnd ? end : pointInWorld;
    const place = seen(this.from);
    this.offset = place && pixel ? { u: place.u - pixel.u, v: place.v - pixel.v } : { u: 0, v: 0 };
  }

  move(x: number, y: number): void {
    this.at = { x, y };
    this.started ||= Math.hypot(x - this.press.x, y - this.press.y) >= STARTS_PX;
    if (this.started) this.tick();
  }

  tick(): void {
    if (!this.started) return;
    const { aim, pane, at, session, offset } = this;
    const pixel = aim.pixelAt(pane, at.x, at.y);
    this.landing =
      pixel && aim.landing(pane, { u: pixel.u + offset.u, v: pixel.v + offset.v }, true);
    if (!this.landing) return;
    const delta = subtract(this.landing.pointInWorld, this.from);
    if (this.byEnd) {
      session.annotations.preview(this.grabbed.id, (mark) => withEnd(mark, delta));
      return;
    }
    for (const { id } of [this.grabbed, ...this.others]) {
      session.annotations.preview(id, (mark) => shifted(mark, delta));
    }
  }

  end(x: number, y: number): void {
    this.move(x, y);
    const { landing, session, state, edits, grabbed, others, pane } = this;
    if (!this.started) return;
    if (!landing) {
      state.refuse(pane, `Not moved: ${this.aim.whyNoLanding(pane)}`);
      return this.cancel();
    }
    const { target, later, pointInWorld } = landing;
    const site = { target, later, guessInWorld: pointInWorld };
    const delta = subtract(pointInWorld, this.from);
    const group = others.length > 0 ? newUuid() : '';
    const change = (id: string, what: Change): void => {
      const edit = (): Promise<void> => edits.change(id, what, group);
      void attempt(state, pane, edit, 'Not moved: ').then(() => session.annotations.endPreview(id));
    };
    change(grabbed.id, this.byEnd ? { end: site } : { place: site });
    for (const { id, anchor } of others) {
      if (!anchor.pointInWorld) continue;
      const to = add(anchor.pointInWorld, delta);
      change(id, { place: { target: { kind: 'point', pointInWorld: to }, guessInWorld: to } });
    }
  }

  cancel(): void {
    for (const { id } of [this.grabbed, ...this.others]) this.session.annotations.endPreview(id);
  }
}

function shifted(mark: Annotation, delta: Vec3): Annotation {
  const { pointInWorld } = mark.anchor;
  if (!pointInWorld) return mark;
  return { ...mark, anchor: { ...mark.anchor, pointInWorld: add(pointInWorld, delta) } };
}

/** A measure whose other end was moved; its length is known anew once the server has said it. */
function withEnd(mark: Annotation, delta: Vec3): Annotation {
  const inkOffsetsM = [add(mark.inkOffsetsM[0] ?? ZERO, delta)];
  const [end = ZERO] = inkOffsetsM;
  return { ...mark, inkOffsetsM, lengthM: Math.hypot(end.x, end.y, end.z) };
}
