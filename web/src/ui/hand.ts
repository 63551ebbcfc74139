import type { Annotation } from '../session/types';
import type { Landing } from '../tools/landing';
import type { ToolName } from '../tools/tools';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import type { Drag } from './drag';
import type { Grips } from './grips';
import type { Measuring } from './measuring';
import type { PaneGestures } from './pointer';
import { type Spot, spotAt } from './thing_spot';
import type { Things } from './things';

export interface HandHelpers {
  readonly aim: Aim;
  readonly measuring: Measuring;
  readonly grips: Grips;
  readonly things: Things;
}

export interface HandActions {
  act(
    pane: PaneName,
    landing: Landing | undefined,
    picked: Annotation | undefined,
    adds: boolean,
    spot: Spot | undefined,
  ): void;
  point(id: string | undefined): void;
}

/** Tools whose mark is sent some time after the click. */
const LATE: readonly ToolName[] = ['note', 'measure', 'check_list', 'picture'];
const HOLDING = 'Held: move, then Enter lets go; Esc gives up';

/** A pointer or the keyboard in the panes: what is under it, what it holds, what it clicks. */
export class Hand {
  /** What was under the pointer when it went down: the picture may change before it comes up. */
  private pressed:
    | {
        landing: Landing | undefined;
        picked: Annotation | undefined;
        spot: Spot | undefined;
      }
    | undefined;
  private drag: Drag | undefined;
  /** A drag that keys hold: Enter to Enter. */
  private keyDrag: { readonly drag: Drag; readonly pane: PaneName } | undefined;

  constructor(
    private readonly state: AppState,
    private readonly with_: HandHelpers,
    private readonly acts: HandActions,
  ) {}

  /** True where there is something to give up. */
  get busy(): boolean {
    const { measuring, things } = this.with_;
    const holds = this.drag !== undefined || this.keyDrag !== undefined;
    return holds || measuring.begun || things.begun;
  }

  /** Whatever is under way has not been. */
  letGo(): void {
    this.with_.measuring.cancel();
    this.with_.things.cancel();
    for (const drag of [this.drag, this.keyDrag?.drag]) drag?.cancel();
    this.drag = this.keyDrag = undefined;
  }

  gestures(pane: PaneName): PaneGestures {
    return {
      hover: (x, y) => {
        this.state.byKeys = false;
        this.hover(pane, x, y);
      },
      leave: () => this.leave(pane),
      moved: () => {
        this.state.hover = undefined;
        this.with_.aim.map.map?.hold();
      },
      grab: (press) => {
        this.state.hover = undefined;
        return (this.drag = this.with_.grips.grab(pane, press));
      },
      let: () => (this.drag = undefined),
      holding: () => this.drag !== undefined,
      press: (x, y) => this.press(pane, x, y),
      click: (x, y, adds) => this.click(pane, x, y, adds),
    };
  }

  /** Once per screen frame. */
  tickDrags(): void {
    for (const drag of [this.drag, this.keyDrag?.drag]) drag?.tick?.();
  }

  private press(pane: PaneName, x: number, y: number): void {
    const { aim } = this.with_;
    const pixel = aim.pixelAt(pane, x, y);
    const current = pane === 'video' ? aim.video.current() : undefined;
    if (current && pixel) {
      const { dataset } = aim.video.element; // for tests: which frame a click meant
      dataset['pressed'] = `${current.facts.frameId} ${pixel.u} ${pixel.v}`;
    }
    const late = LATE.includes(this.state.tool);
    const landing = pixel && aim.landing(pane, pixel, late);
    if (pane === 'map' && pixel) {
      const { x = NaN, y = NaN, z = NaN } = landing?.pointInWorld ?? {};
      const said = [pixel.u, pixel.v, landing?.how ?? 'nothing', x, y, z];
      aim.map.element.dataset['pressed'] = said.join('|'); // for tests
    }
    this.pressed = pixel && {
      landing,
      picked: aim.pick(pane, pixel),
      spot: this.state.tool === 'thing' ? spotAt(aim, pane, pixel) : undefined,
    };
  }

  private click(pane: PaneName, x: number, y: number, adds: boolean): void {
    if (pane === 'map') this.press(pane, x, y); // it may have turned since it was pressed
    const { pressed } = this;
    this.pressed = undefined;
    this.acts.act(pane, pressed?.landing, pressed?.picked, adds, pressed?.spot);
  }

  /** Enter in a pane: clicks at its keyboard place, or takes hold there and lets go with the next. */
  keyPress(pane: PaneName, shift: boolean): void {
    const { state } = this;
    const { x, y } = this.with_.aim.keyPlace(pane);
    if (this.keyDrag) {
      const { drag } = this.keyDrag;
      this.keyDrag = undefined;
      drag.end(x, y);
      return state.changed();
    }
    const holds = state.tool !== 'box';
    const drag = holds ? this.with_.grips.grab(pane, { x, y, shift, ctrl: false }) : undefined;
    // A free place under the select tool is a click; the rectangle has a tool of its own.
    const kept = drag && !(state.tool === 'select' && !this.onSelected(pane, x, y));
    if (kept) {
      this.keyDrag = { drag, pane };
      return state.say(pane, HOLDING);
    }
    drag?.cancel();
    this.press(pane, x, y);
    this.click(pane, x, y, shift || state.tool === 'area');
  }

  private onSelected(pane: PaneName, x: number, y: number): boolean {
    const pixel = this.with_.aim.pixelAt(pane, x, y);
    const picked = pixel && this.with_.aim.pick(pane, pixel);
    return picked !== undefined && this.state.selection.has(picked.id);
  }

  /** The keyboard's place in the video goes so far, as shares of the picture. */
  moveCursor(dx: number, dy: number): void {
    const { x, y } = this.state.cursor ?? { x: 0.5, y: 0.5 };
    const within = (value: number): number => Math.min(Math.max(value, 0.01), 0.99);
    this.state.cursor = { x: within(x + dx), y: within(y + dy) };
    this.state.byKeys = true;
    this.keyMoved('video');
  }

  /** What keys point at has changed in that pane. */
  keyMoved(pane: PaneName): void {
    const { x, y } = this.with_.aim.keyPlace(pane);
    if (this.keyDrag?.pane === pane) this.keyDrag.drag.move(x, y);
    else this.hover(pane, x, y);
  }

  private hover(pane: PaneName, x: number, y: number): void {
    const { state } = this;
    const { aim, measuring } = this.with_;
    state.pointer = { pane, x, y };
    const pixel = aim.pixelAt(pane, x, y);
    if (state.tool === 'select' || state.tool === 'area') {
      const byKey = pixel && state.byKeys && pane === 'video';
      state.hover = byKey ? { pane, pixel, landing: aim.landing(pane, pixel) } : undefined;
      state.moved();
      return this.pointAt(pixel && aim.pick(pane, pixel)?.id);
    }
    const spot = pixel && state.tool === 'thing' ? spotAt(aim, pane, pixel) : undefined;
    const landing = spot ? this.with_.things.landing(spot) : pixel && aim.landing(pane, pixel);
    const words = state.tool === 'measure' ? measuring.hover(landing) : undefined;
    state.hover = pixel && { pane, pixel, landing, words };
    state.moved();
  }

  /** The mark under the pointer shows all that it says. */
  private pointAt(id: string | undefined): void {
    if (id !== this.state.pointedId) this.acts.point(id);
  }

  private leave(pane: PaneName): void {
    const { state } = this;
    state.pointer = undefined;
    if (state.tool === 'select' && state.pointedId) this.acts.point(undefined);
    if (state.hover?.pane !== pane) return;
    state.hover = undefined;
    state.moved();
  }
}
