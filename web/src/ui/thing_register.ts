import { transform } from '../geometry/rigid3';
import { pixelDistance, scale, type Vec3 } from '../geometry/vec3';
import { projectPoint } from '../geometry/view';
import type { Thing } from '../session/scene_book';
import type { Pair, Registration, SceneEdits } from '../session/scene_edits';
import type { Session } from '../session/session';
import { cornersOf } from '../tools/thing_rays';
import { UNMEASURED } from './thing_measure';
import { ThingPoints } from './thing_points';
import type { Spot } from './thing_spot';

export const LEAST_PAIRS = 4;
const CORNER_PX = 24;

/** Where a thing lies in the map, by points clicked on both in turn; its error before it is accepted. */
export class ThingRegister {
  thing: Thing | undefined;
  readonly pairs: Pair[] = [];
  result: Registration | undefined;
  why = ''; // there is none
  private corner: Vec3 | undefined; // clicked on the thing, not yet in the map
  private corners: readonly Vec3[] = [];
  private readonly points: ThingPoints;

  constructor(
    private readonly session: Session,
    private readonly edits: SceneEdits,
    colour: () => number,
  ) {
    this.points = new ThingPoints(session, colour);
  }

  /** In words, what the next click is. */
  get step(): string {
    const { thing, pairs, corner } = this;
    if (!thing) return 'Select the thing in the list first.';
    const next = corner ? `the same point in the map or the video` : `a corner of ${thing.name}`;
    return `Point ${pairs.length + 1}: click ${next}.`;
  }

  async begin(thing: Thing | undefined): Promise<void> {
    this.cancel();
    this.thing = thing;
    if (!thing) return;
    const file = this.session.scene.files.get(thing.modelId);
    this.corners =
      thing.shape === 'model' && file
        ? await (await import('../scene/scene_meshes')).pointsOf(file)
        : cornersOf(thing);
  }

  /** Why a click means nothing; undefined: taken. */
  async click(spot: Spot, cssPerPixel: number): Promise<string | undefined> {
    if (!this.thing) return this.step;
    if (!this.corner) {
      this.corner = this.cornerAt(spot, CORNER_PX / cssPerPixel);
      return this.corner ? undefined : `no corner of ${this.thing.name} is there`;
    }
    const { landing } = spot;
    if (landing?.how !== 'feature' && landing?.how !== 'plane') {
      return UNMEASURED;
    }
    this.pairs.push({ inObject: this.corner, inWorld: landing.pointInWorld });
    this.points.add(landing.pointInWorld);
    this.corner = undefined;
    await this.solve();
    return undefined;
  }

  private cornerAt({ view, pixel }: Spot, within: number): Vec3 | undefined {
    const { thing } = this;
    if (!thing) return undefined;
    const factor = thing.shape === 'model' ? thing.scale : 1;
    let best: { corner: Vec3; away: number } | undefined;
    for (const corner of this.corners) {
      const at = projectPoint(view, transform(thing.parentFromObject, scale(corner, factor)));
      const away = at ? pixelDistance(at, pixel) : Infinity;
      if (away <= within && away < (best?.away ?? Infinity)) best = { corner, away };
    }
    return best?.corner;
  }

  /** Takes a pair out again. */
  async drop(index: number): Promise<void> {
    this.pairs.splice(index, 1);
    this.points.clear();
    for (const { inWorld } of this.pairs) this.points.add(inWorld);
    await this.solve();
  }

  private async solve(): Promise<void> {
    this.result = undefined;
    this.why = '';
    if (!this.thing || this.pairs.length < LEAST_PAIRS) return;
    try {
      this.result = await this.edits.register(this.thing.id, this.pairs, this.withScale, false);
    } catch (error) {
      this.why = error instanceof Error ? error.message : String(error);
    }
  }

  /** Only a map without metres can tell a model's size. */
  private get withScale(): boolean {
    return this.thing?.shape === 'model' && !this.session.scale.metric;
  }

  async accept(): Promise<string> {
    const { thing, pairs } = this;
    if (!thing) return '';
    const { rmsMm } = await this.edits.register(thing.id, pairs, this.withScale, true);
    this.cancel();
    return `${thing.name} registered: ${rmsMm.toFixed(1)} mm`;
  }

  cancel(): void {
    this.thing = this.corner = this.result = undefined;
    this.why = '';
    this.pairs.length = 0;
    this.points.clear();
  }
}
