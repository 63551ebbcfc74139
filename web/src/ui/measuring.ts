import { subtract } from '../geometry/vec3';
import { lengthWords } from '../scene/label_words';
import { DEFAULT_SIZE_M, type Edits } from '../session/edits';
import type { Session } from '../session/session';
import { newUuid } from '../session/uuid';
import type { Landing } from '../tools/landing';
import { lengthBetween } from '../tools/measure';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import { holdFrame } from './hold_frame';

/** A distance from its first click to its second; between them the length follows the pointer. */
export class Measuring {
  private from: Landing | undefined;
  private mapRevision: number | undefined;
  private readonly pendingId = newUuid();

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
  ) {}

  get begun(): boolean {
    return this.from !== undefined;
  }

  /** What stands beside the pointer; undefined before the first click. */
  hover(landing: Landing | undefined): string | undefined {
    const { from, session, state } = this;
    if (!from) return undefined;
    if (!landing) return undefined;
    const { lengthM, sigmaM } = lengthBetween(from, landing);
    session.annotations.addPending({
      ...{ requestId: this.pendingId, shape: 'measure', text: '', sizeM: DEFAULT_SIZE_M },
      ...{ colorRgba: state.colorRgba, pointInWorld: from.pointInWorld },
      inkOffsetsM: [subtract(landing.pointInWorld, from.pointInWorld)],
    });
    return lengthWords(lengthM, sigmaM, session.scale.metric);
  }

  click(pane: PaneName, landing: Landing): void {
    const { from, session, state } = this;
    const { mapRevision } = session.pose ?? {};
    if (from && mapRevision !== this.mapRevision) {
      this.cancel();
      return state.refuse(
        pane,
        'Not placed: the map has changed since the first click. Click both.',
      );
    }
    if (!from) {
      this.from = landing;
      this.mapRevision = mapRevision;
      holdFrame(session, landing);
      return state.say(pane, 'Now its other end; Esc gives up');
    }
    const offset = subtract(landing.pointInWorld, from.pointInWorld);
    this.cancel();
    void attempt(state, pane, async () => {
      const placed = await this.edits.place({
        ...{ shape: 'measure', text: '', colorRgba: state.colorRgba },
        ...{ target: from.target, later: from.later, guessInWorld: from.pointInWorld },
        end: { target: landing.target, later: landing.later, guessInWorld: landing.pointInWorld },
        inkOffsetsM: [offset],
      });
      state.selectedId = placed.id;
    });
  }

  cancel(): void {
    this.from = undefined;
    this.session.annotations.removePending(this.pendingId);
    this.state.moved();
  }
}
