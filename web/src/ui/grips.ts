import { pixelDistance, type Pixel } from '../geometry/vec3';
import type { Edits } from '../session/edits';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import { handleOf } from '../tools/handle';
import { pickThing } from '../tools/thing_rays';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { AreaDrag } from './area_drag';
import { BoxDrag } from './box_drag';
import type { Drag } from './drag';
import { InkDrag } from './ink_drag';
import { LaserDrag } from './laser_drag';
import { MoveDrag } from './move_drag';
import { whyNotChange, whyNotEdit } from './rights';
import { ThingDrag } from './thing_drag';
import { spotAt } from './thing_spot';
import type { Things } from './things';
import { TurnDrag } from './turn_drag';

const HANDLE_PX = 16; // CSS px

export interface Press {
  readonly x: number;
  readonly y: number;
  readonly shift: boolean;
  readonly ctrl: boolean;
}

/** What a press begins that is more than a click, given the tool in hand. */
export class Grips {
  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly things: Things,
  ) {}

  /** Undefined: a click, or a turn of the map. */
  grab(pane: PaneName, press: Press): Drag | undefined {
    const { state, aim } = this;
    if (state.tool === 'area') {
      const corner = aim.pixelNear(pane, press.x, press.y); // a corner beside the picture is one
      return new AreaDrag(state, aim, pane, corner, press.shift);
    }
    const pixel = aim.pixelAt(pane, press.x, press.y);
    if (!pixel) return undefined;
    switch (state.tool) {
      case 'laser':
        return this.may(pane) ? this.laser(pane, press) : undefined;
      case 'ink':
        return this.may(pane) ? this.ink(pane, pixel, press) : undefined;
      case 'box':
        return this.may(pane) ? this.box(pane, pixel) : undefined;
      case 'thing':
        return this.thing(pane, pixel);
      case 'select':
        return this.take(pane, pixel, press);
      default:
        return undefined;
    }
  }

  private may(pane: PaneName): boolean {
    const why = whyNotEdit(this.session);
    const reason = why ?? (this.session.live ? undefined : 'No connection to the server.');
    if (reason !== undefined) this.state.refuse(pane, reason);
    return reason === undefined;
  }

  /** The selected thing is pushed; any other press is a click, or turns the map. */
  private thing(pane: PaneName, pixel: Pixel): Drag | undefined {
    const { session, state, aim, things } = this;
    const spot = things.clickDoes === 'select' ? spotAt(aim, pane, pixel) : undefined;
    const { things: all, models } = session.scene;
    const picked = spot && pickThing(all, models, spot.ray);
    if (!picked || picked.id !== state.thingId || !this.may(pane)) return undefined;
    return new ThingDrag(session, state, aim, pane, picked, (way, handM) =>
      things.moves.pushTowards(way, handM),
    );
  }

  private laser(pane: PaneName, { x, y }: Press): Drag {
    return new LaserDrag(this.session, this.state, this.aim, pane, x, y);
  }

  /** The live picture holds while one draws in it: a hand cannot follow a head. */
  private ink(pane: PaneName, pixel: Pixel, { x, y }: Press): Drag | undefined {
    const { session, edits, state, aim } = this;
    const holds = pane === 'video' && !aim.video.frozen && aim.video.freeze();
    const goOn = (): void => {
      if (holds) aim.video.thaw();
    };
    const landing = aim.landing(pane, pixel, true);
    const view = aim.view(pane);
    if (!landing || !view) {
      goOn();
      state.refuse(pane, `Not drawn: ${aim.whyNoLanding(pane)}`);
      return undefined;
    }
    const drag = new InkDrag(session, edits, state, aim, pane, { landing, view, goOn });
    drag.move(x, y);
    return drag;
  }

  private box(pane: PaneName, pixel: Pixel): Drag | undefined {
    const { session, edits, state, aim } = this;
    const landing = aim.landing(pane, pixel, true);
    const view = aim.view(pane);
    return landing && view && new BoxDrag(session, edits, state, aim, pane, landing, view);
  }

  /** The handle of the selected mark, a selected mark, or a rectangle where there is none. */
  private take(pane: PaneName, pixel: Pixel, press: Press): Drag | undefined {
    const { state, aim, session, edits } = this;
    if (press.ctrl) return new AreaDrag(state, aim, pane, pixel, press.shift);
    if (press.shift) return undefined;
    const view = aim.view(pane);
    const turnable = (pane === 'map' ? aim.map : aim.video).turnable();
    const handle = view && handleOf(view, turnable);
    const mark = turnable && session.annotations.get(turnable.id);
    if (handle && mark && pixelDistance(handle, pixel) * aim.scale(pane) < HANDLE_PX) {
      if (!this.changes(pane, [mark])) return undefined;
      return new TurnDrag(session, edits, state, aim, pane, mark);
    }
    const picked = aim.pick(pane, pixel);
    if (picked && state.selection.has(picked.id)) return this.move(pane, picked, press);
    if (picked || pane === 'map') return undefined; // the map turns under a free press
    return new AreaDrag(state, aim, pane, pixel, press.shift);
  }

  private move(pane: PaneName, grabbed: Annotation, press: Press): Drag | undefined {
    const { state, aim, session, edits } = this;
    const marks = [...state.selection].flatMap((id) => session.annotations.get(id) ?? []);
    // Said only where it is dragged: a click on a locked mark is just a click.
    const why = marks.map((mark) => whyNotChange(session, mark)).find(Boolean);
    if (why) return refusing(() => state.refuse(pane, `Not moved: ${why}`));
    const others = marks.filter(({ id }) => id !== grabbed.id);
    return new MoveDrag(session, edits, state, aim, pane, grabbed, others, press);
  }

  private changes(pane: PaneName, marks: readonly Annotation[]): boolean {
    const why = marks.map((mark) => whyNotChange(this.session, mark)).find(Boolean);
    if (why) this.state.refuse(pane, why);
    return why === undefined;
  }
}

/** A drag that may not be: says so once it is one. */
function refusing(say: () => void): Drag {
  const nothing = (): void => undefined;
  return { clicks: true, move: nothing, end: say, cancel: nothing };
}
