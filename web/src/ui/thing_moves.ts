import { multiply } from '../geometry/rigid3';
import { add, scale, type Vec3 } from '../geometry/vec3';
import type { Thing } from '../session/scene_book';
import type { Placed, SceneEdits } from '../session/scene_edits';
import type { Session } from '../session/session';
import { DOWN, type Way, wayInWorld } from '../tools/thing_places';
import { about } from '../tools/turn';
import type { Aim } from './aim';
import type { AppState } from './app_state';
import { placedWords, type ThingErrands } from './thing_errands';

const TURN_STEP_DEG = 15;

/** What is done to the selected thing: pushed, turned, deleted. */
export class ThingMoves {
  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly edits: SceneEdits,
    private readonly errands: ThingErrands,
  ) {}

  /** Along the floor as the main view sees it, until it touches; then it is lowered until it rests. */
  push(way: Way): void {
    const { main } = this.state;
    const view = this.aim.view(main);
    if (!view) return this.errands.say(`Not pushed: ${this.aim.whyNoLanding(main)}`, true);
    this.pushTowards(wayInWorld(view, way));
  }

  /** `handM`: how far the hand goes: what meets a wall aslant slides along it. */
  pushTowards(way: Vec3, handM = 0): void {
    this.withSelected('pushed', (thing) => this.edits.place(thing, way, handM));
  }

  turn(sign: 1 | -1): void {
    const turn = about(DOWN, (sign * TURN_STEP_DEG * Math.PI) / 180);
    this.withSelected('turned', (thing) => {
      const { rotation, translation } = thing.parentFromObject;
      return this.edits.place({
        ...thing,
        parentFromObject: {
          rotation: multiply(turn, rotation),
          translation: add(translation, scale(DOWN, -0.002)),
        },
      });
    });
  }

  remove(): void {
    const thing = this.session.scene.thing(this.state.thingId);
    if (!thing) return this.errands.say('Not deleted: select a thing first.', true);
    this.errands.run('map', async () => {
      await this.edits.remove(thing.id);
      this.state.thingId = '';
      return `${thing.name} deleted; Undo brings it back`;
    });
  }

  private withSelected(done: string, act: (thing: Thing) => Promise<Placed>): void {
    const thing = this.session.scene.thing(this.state.thingId);
    if (!thing) return this.errands.say(`Not ${done}: select a thing first.`, true);
    if (thing.material === 'real') {
      return this.errands.say(`Not ${done}: ${thing.name} is real: it stays where it is.`, true);
    }
    const ask = async (): Promise<string> => {
      const placed = await act(thing);
      this.state.thingId = placed.thing.id;
      return placedWords(placed);
    };
    this.errands.run('map', ask, `Not ${done}: `);
  }
}
