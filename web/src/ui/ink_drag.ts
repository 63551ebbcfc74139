import type { Plane } from '../geometry/plane';
import { type Pixel, subtract, type Vec3 } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { DEFAULT_SIZE_M, type Edits } from '../session/edits';
import { Pointing } from '../session/pointing';
import type { Session } from '../session/session';
import { newUuid } from '../session/uuid';
import { isTooNear, needed, onPlane, planeOf, Smoother } from '../tools/ink';
import type { Landing } from '../tools/landing';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import type { Drag } from './drag';

const TOLERANCE_PX = 0.6; // of what is kept, against what was drawn
const MOST_POINTS = 2000; // annotation.proto

/** Of the press, in the frame the stroke belongs to. */
export interface InkBegun {
  readonly landing: Landing;
  readonly view: View;
  /** The stroke is done, or given up. */
  goOn(): void;
}

/** A stroke from the press to the server's answer: others see it grow, and then it is a mark. */
export class InkDrag implements Drag {
  readonly clicks = false;
  private readonly smoother = new Smoother();
  private readonly plane: Plane;
  private readonly pendingId = newUuid();
  private readonly pointing: Pointing;
  private readonly inWorld: Vec3[] = [];
  private readonly colorRgba: number;
  private last: Pixel | undefined;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    private readonly begun: InkBegun,
  ) {
    this.plane = planeOf(begun.landing, begun.view);
    this.colorRgba = state.colorRgba;
    // Said once it is a mark, or not: what the others miss meanwhile is no reason to stop.
    this.pointing = new Pointing(session, 'sketch', this.colorRgba, () => undefined);
  }

  move(x: number, y: number): void {
    const at = this.smoother.add({ u: x, v: y }, performance.now());
    if (!isTooNear(this.last, at)) this.put(at);
  }

  /** A place of the page onto the stroke's plane, as the picture shows it now. */
  private put(at: Pixel): void {
    const { aim, pane } = this;
    const view = aim.view(pane);
    const pixel = aim.pixelAt(pane, at.u, at.v);
    const point = view && pixel && onPlane(view, this.plane, pixel);
    if (!point) return;
    this.last = at;
    this.inWorld.push(point);
    // A picture's pixels lie on what the server knows to be there, as those of the mark will.
    const { target } = this.begun.landing;
    if (target.kind === 'pixel') this.pointing.add({ ...target, pixel });
    else this.pointing.add({ kind: 'point', pointInWorld: point });
    this.show();
  }

  private show(): void {
    const [origin] = this.inWorld;
    if (!origin) return;
    const { pendingId: requestId, colorRgba } = this;
    this.session.annotations.addPending({
      ...{ requestId, shape: 'ink', text: '', sizeM: DEFAULT_SIZE_M, colorRgba },
      pointInWorld: origin,
      inkOffsetsM: this.inWorld.map((point) => subtract(point, origin)),
    });
  }

  end(x: number, y: number): void {
    this.put({ u: x, v: y });
    const { pane, state, edits } = this;
    const [origin] = this.inWorld;
    if (!origin || this.inWorld.length < 2) {
      state.refuse(pane, 'Nothing drawn: press, and move while you hold.');
      return this.cancel();
    }
    // In one piece with its answer, so that nobody sees it go and come back.
    const kept = this.kept();
    const { target, later } = this.begun.landing;
    const placing = edits.place({
      ...{ shape: 'ink', text: '', colorRgba: this.colorRgba, target, later },
      guessInWorld: origin,
      inkPx: target.kind === 'pixel' ? kept.map(({ pixel }) => pixel) : [],
      inkOffsetsM: kept.map(({ point }) => subtract(point, origin)),
    });
    this.session.annotations.removePending(this.pendingId);
    this.begun.goOn();
    void attempt(state, pane, () => placing).then(() => this.pointing.end());
  }

  /** What the line needs, in the first frame and in world. */
  private kept(): { pixel: Pixel; point: Vec3 }[] {
    const seen: { pixel: Pixel; point: Vec3 }[] = [];
    for (const point of this.inWorld) {
      const pixel = projectPoint(this.begun.view, point);
      if (pixel) seen.push({ pixel, point });
    }
    const pixels = seen.map(({ pixel }) => pixel);
    for (let tolerance = TOLERANCE_PX / this.aim.scale(this.pane); ; tolerance *= 2) {
      const some = needed(pixels, tolerance);
      if (some.length > MOST_POINTS) continue;
      return some.flatMap((i) => seen[i] ?? []);
    }
  }

  cancel(): void {
    this.begun.goOn();
    this.session.annotations.removePending(this.pendingId);
    this.pointing.end();
  }
}
