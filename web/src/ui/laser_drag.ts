import { Pointing } from '../session/pointing';
import type { Session } from '../session/session';
import { plainWords } from '../transport/errors';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import type { Drag } from './drag';

/** Shows the others where one points, for as long as it is pressed. */
export class LaserDrag implements Drag {
  readonly clicks = false;
  readonly prompt = true;
  private readonly pointing: Pointing;
  private at: { x: number; y: number };
  private sent = '';

  constructor(
    session: Session,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    x: number,
    y: number,
  ) {
    const failed = (error: unknown): void =>
      state.refuse(pane, `The others do not see where you point: ${plainWords(error)}`);
    this.colorRgba = session.joined?.colorRgba || state.colorRgba;
    this.pointing = new Pointing(session, 'laser', this.colorRgba, failed);
    this.at = { x, y };
    this.tick();
  }

  private readonly colorRgba: number;

  move(x: number, y: number): void {
    this.at = { x, y };
    this.tick();
  }

  /** Aims anew where the pointer has moved, or the picture under it. */
  tick(): void {
    const { aim, pane, at, state } = this;
    const pixel = aim.pixelAt(pane, at.x, at.y);
    const target = pixel && aim.target(pane, pixel);
    const key = JSON.stringify(target);
    if (!pixel || !target || key === this.sent) return;
    this.sent = key;
    this.pointing.add(target);
    const landing = aim.landing(pane, pixel);
    state.laser = landing && { pointInWorld: landing.pointInWorld, colorRgba: this.colorRgba };
    state.moved();
  }

  end(): void {
    this.pointing.end();
    this.state.laser = undefined;
    this.state.moved();
  }

  cancel(): void {
    this.end();
  }
}
