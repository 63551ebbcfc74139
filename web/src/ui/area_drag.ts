import type { Pixel } from '../geometry/vec3';
import { projectPoint } from '../geometry/view';
import { labelPoint } from '../scene/shapes';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import type { Drag } from './drag';

/** Selects the marks in a rectangle, in addition to those selected before where `adds`. */
export class AreaDrag implements Drag {
  readonly clicks = true;
  private to: Pixel;

  constructor(
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    private readonly from: Pixel,
    private readonly adds: boolean,
  ) {
    this.to = from;
  }

  move(x: number, y: number): void {
    const { aim, pane, state, from } = this;
    this.to = aim.pixelNear(pane, x, y);
    state.area = { pane, from, to: this.to };
    state.moved();
  }

  end(x: number, y: number): void {
    this.move(x, y);
    const { aim, pane, state, from, to } = this;
    this.cancel();
    const view = aim.view(pane);
    // No mark is drawn there, either.
    if (!view) return state.refuse(pane, `Nothing selected: ${aim.whyNoLanding(pane)}`);
    const marks = (pane === 'map' ? aim.map : aim.video).marks();
    const found = marks.filter((mark) => {
      const ends = [mark.pointInWorld, labelPoint(mark)];
      const seen = ends.map((end) => projectPoint(view, end));
      return mark.id !== '' && seen.some((at) => at && isWithin(at, from, to));
    });
    const ids = found.map(({ id }) => id);
    state.select(this.adds ? [...state.selection, ...ids] : ids);
  }

  cancel(): void {
    this.state.area = undefined;
    this.state.moved();
  }
}

const isWithin = (p: Pixel, a: Pixel, b: Pixel): boolean =>
  p.u >= Math.min(a.u, b.u) &&
  p.u <= Math.max(a.u, b.u) &&
  p.v >= Math.min(a.v, b.v) &&
  p.v <= Math.max(a.v, b.v);
