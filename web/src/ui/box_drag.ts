import type { Plane } from '../geometry/plane';
import type { Pixel } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { DEFAULT_SIZE_M, type Edits } from '../session/edits';
import type { Session } from '../session/session';
import { newUuid } from '../session/uuid';
import { boxBetween, type DrawnBox } from '../tools/box';
import { onPlane, planeOf } from '../tools/ink';
import type { Landing } from '../tools/landing';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import type { Drag } from './drag';

/** Draws a box from one corner to the other, on the surface that was pressed. */
export class BoxDrag implements Drag {
  readonly clicks = true;
  private readonly plane: Plane;
  private readonly pendingId = newUuid();
  private drawn: DrawnBox | undefined;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    private readonly landing: Landing,
    first: View,
  ) {
    this.plane = planeOf(landing, first);
  }

  move(x: number, y: number): void {
    const { aim, pane, plane, landing, session, state } = this;
    const view = aim.view(pane);
    const pixel = aim.pixelAt(pane, x, y);
    const corner = view && pixel && onPlane(view, plane, pixel);
    if (!corner) return;
    this.drawn = boxBetween(view, landing.pointInWorld, corner);
    const { middleInWorld: pointInWorld, worldFromMark, extentM } = this.drawn;
    const { colorRgba } = state;
    const look = { shape: 'box', text: '', sizeM: DEFAULT_SIZE_M, colorRgba } as const;
    const requestId = this.pendingId;
    session.annotations.addPending({ requestId, pointInWorld, worldFromMark, extentM, ...look });
  }

  end(x: number, y: number): void {
    this.move(x, y);
    const { aim, pane, drawn, state, edits } = this;
    const view = aim.view(pane);
    const middle: Pixel | undefined = view && drawn && projectPoint(view, drawn.middleInWorld);
    const landing = middle && aim.landing(pane, middle);
    this.cancel();
    if (!drawn || !landing) {
      return state.refuse(pane, `Not placed: ${aim.whyNoLanding(pane)}`);
    }
    const { worldFromMark, extentM, middleInWorld: guessInWorld } = drawn;
    const { target, later } = landing;
    const { colorRgba } = state;
    void attempt(state, pane, async () => {
      const where = { target, later, guessInWorld, worldFromMark, extentM };
      const placed = await edits.place({ shape: 'box', text: '', colorRgba, ...where });
      state.selectedId = placed.id;
    });
  }

  cancel(): void {
    this.session.annotations.removePending(this.pendingId);
  }
}
