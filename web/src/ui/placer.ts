import type { Edits } from '../session/edits';
import type { Session } from '../session/session';
import type { Shape } from '../session/types';
import { uprightFor } from '../tools/box';
import type { Landing } from '../tools/landing';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import { holdFrame } from './hold_frame';
import type { ListDialog } from './list_dialog';
import type { Measuring } from './measuring';
import type { Notes } from './notes';
import type { PictureDialog } from './picture_dialog';

const BOX_M = 0.1;

/** What a click with a tool that makes marks does. */
export class Placer {
  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly notes: Notes,
    private readonly measuring: Measuring,
    private readonly dialogs: { readonly list: ListDialog; readonly picture: PictureDialog },
  ) {}

  click(shape: Shape, pane: PaneName, landing: Landing | undefined): void {
    const { state } = this;
    if (shape === 'note') return this.notes.click(landing, this.aim.whyNoLanding(pane));
    if (!this.session.live) return state.refuse(pane, 'Not placed: no connection to the server.');
    if (!landing) return state.refuse(pane, `Not placed: ${this.aim.whyNoLanding(pane)}`);
    switch (shape) {
      case 'measure':
        return this.measuring.click(pane, landing);
      case 'check_list':
        return void this.checkList(pane, landing);
      case 'picture':
        return void this.picture(pane, landing);
      case 'ink':
        return; // it is drawn, not clicked
      default:
        return this.place(shape, pane, landing);
    }
  }

  private place(shape: Shape, pane: PaneName, landing: Landing): void {
    const { state, edits, aim } = this;
    const view = shape === 'box' ? aim.view(pane) : undefined;
    const { colorRgba } = state;
    void attempt(state, pane, async () => {
      const placed = await edits.place({
        ...{ shape, text: '', colorRgba, target: landing.target, later: landing.later },
        guessInWorld: landing.pointInWorld,
        ...(view && {
          worldFromMark: uprightFor(view),
          extentM: { x: BOX_M, y: BOX_M, z: BOX_M },
        }),
      });
      state.selectedId = placed.id;
    });
  }

  private async checkList(pane: PaneName, landing: Landing): Promise<void> {
    const { state, edits, session } = this;
    holdFrame(session, landing);
    await this.dialogs.list.ask(async ({ text, items }) => {
      const placed = await edits.place({
        ...{ shape: 'check_list', text, colorRgba: state.colorRgba, checkItems: items },
        ...{ target: landing.target, later: landing.later, guessInWorld: landing.pointInWorld },
      });
      state.selectedId = placed.id;
      state.changed();
    });
    this.focus(pane);
  }

  /** `file`: one that was dropped there; else it is asked for. */
  async picture(pane: PaneName, landing: Landing, file?: File): Promise<void> {
    const { state, edits, session } = this;
    holdFrame(session, landing);
    await this.dialogs.picture.ask(file, async ({ text, sizeM, picture }) => {
      const placed = await edits.place({
        ...{ shape: 'picture', text, colorRgba: state.colorRgba, sizeM, picture },
        ...{ target: landing.target, later: landing.later, guessInWorld: landing.pointInWorld },
      });
      state.selectedId = placed.id;
      state.changed();
    });
    this.focus(pane);
  }

  private focus(pane: PaneName): void {
    (pane === 'map' ? this.aim.map : this.aim.video).element.focus({ preventScroll: true });
  }
}
