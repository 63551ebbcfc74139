import type { Vec3 } from '../geometry/vec3';
import { type GazeTarget, hasHead } from '../session/gaze';
import { GazeError, type GazePilot } from '../session/gaze_pilot';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import type { Landing } from '../tools/landing';
import type { HeadCommandName } from '../tools/tools';
import type { AppState, Place } from './app_state';
import { ordinal } from './gaze_words';

export interface HeadActions {
  run(command: HeadCommandName): void;
}

/** Turns the camera: takes the lease where that is needed, and says why where it cannot. */
export class GazeController implements HeadActions {
  constructor(
    private readonly session: Session,
    private readonly pilot: GazePilot,
    private readonly state: AppState,
  ) {}

  /** Why the camera cannot be turned; undefined if it can. */
  whyNot(): string | undefined {
    const { session } = this;
    if (!session.live) return 'No connection to the server.';
    if (hasHead(session.gaze)) return undefined;
    return 'This camera is fixed to the wearer: there is no head to turn. Ask the wearer to look there.';
  }

  lookAtMark({ id, anchor }: Annotation, where: Place): void {
    const point = anchor.pointInWorld;
    if (!point) return this.state.refuse(where, 'Not turned: the place of this mark is not known.');
    this.look({ kind: 'annotation', annotationId: id }, point, where);
  }

  lookAtLanding({ target, pointInWorld }: Landing, where: Place): void {
    const named: GazeTarget =
      target.kind === 'feature'
        ? { kind: 'feature', featureId: target.featureId }
        : { kind: 'point', pointInWorld };
    this.look(named, pointInWorld, where);
  }

  run(command: HeadCommandName): void {
    const { state, pilot } = this;
    if (command === 'fast') {
      state.fast = !state.fast;
      return state.changed();
    }
    const whyNot = this.whyNot();
    if (whyNot) return state.refuse('head', whyNot);
    switch (command) {
      case 'stop':
        this.attempt('head', () => pilot.stop());
        break;
      case 'home':
        this.steer('head', () => pilot.home());
        break;
      case 'level':
        this.steer('head', () => pilot.keepHorizon());
        break;
      case 'explore':
        this.steer('head', () => pilot.explore());
        break;
      case 'lease':
        this.attempt('head', async () => {
          if (pilot.lease.kind === 'none') await pilot.acquire();
          else await pilot.release();
        });
        break;
    }
  }

  private look(target: GazeTarget, pointInWorld: Vec3, where: Place): void {
    const { state } = this;
    const whyNot = this.whyNot();
    if (whyNot) return state.refuse(where, whyNot);
    state.askedInWorld = pointInWorld;
    state.hover = undefined;
    state.changed();
    this.steer(where, () => this.pilot.fixate(target, state.fast));
  }

  /** With the lease; without it, says who has it and what place in the queue we have. */
  private steer(where: Place, act: () => Promise<void>): void {
    this.attempt(where, async () => {
      if (await this.pilot.acquire()) return act();
      const { lease } = this.pilot;
      if (lease.kind !== 'waiting') return;
      const { gaze, participants } = this.session;
      const taken = participants.some(
        ({ participantId, role }) =>
          participantId === gaze?.pilot?.participantId && role === 'wearer',
      );
      throw new GazeError(
        `${taken ? 'The wearer has taken over' : `${lease.pilot} pilots`}. You are ${ordinal(lease.position)} in the queue: try again when it is your turn.`,
      );
    });
  }

  private attempt(where: Place, act: () => Promise<void>): void {
    act()
      .catch((error: unknown) => {
        const reason = error instanceof GazeError ? error.message : String(error);
        this.state.refuse(where, where === 'head' ? reason : `Not turned: ${reason}`);
      })
      .finally(() => {
        this.state.askedInWorld = undefined;
        this.state.changed();
      });
  }
}
