import type { Quaternion } from '../geometry/rigid3';
import type { Edits } from '../session/edits';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import { handleLength } from '../tools/handle';
import { turnedTo } from '../tools/turn';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import type { Drag } from './drag';

/** Turns an arrow or a box by its handle. */
export class TurnDrag implements Drag {
  readonly clicks = false;
  private turned: Quaternion | undefined;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    private readonly mark: Annotation,
  ) {}

  move(x: number, y: number): void {
    const { aim, pane, mark, session } = this;
    const view = aim.view(pane);
    const pixel = aim.pixelAt(pane, x, y);
    const { pointInWorld } = mark.anchor;
    if (!view || !pixel || !pointInWorld) return;
    const length = handleLength({ ...mark, pointInWorld });
    const before = this.turned ?? mark.worldFromMark;
    const turned = turnedTo(view, pixel, pointInWorld, length, before);
    if (!turned) return;
    this.turned = turned;
    session.annotations.preview(mark.id, (each) => ({ ...each, worldFromMark: turned }));
  }

  end(x: number, y: number): void {
    this.move(x, y);
    const { turned: worldFromMark, mark, state, edits, pane, session } = this;
    if (!worldFromMark) return this.cancel();
    const edit = (): Promise<void> => edits.change(mark.id, { worldFromMark });
    void attempt(state, pane, edit, 'Not turned: ').then(() =>
      session.annotations.endPreview(mark.id),
    );
  }

  cancel(): void {
    this.session.annotations.endPreview(this.mark.id);
  }
}
