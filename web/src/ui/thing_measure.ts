import type { Quaternion } from '../geometry/rigid3';
import { distance } from '../geometry/vec3';
import { eyeOf } from '../geometry/view';
import type { ThingDraft } from '../session/scene_edits';
import type { Session } from '../session/session';
import { boxOf, facing, planeOf, wayInWorld } from '../tools/thing_places';
import { ThingPoints } from './thing_points';
import type { Spot } from './thing_spot';

export const UNMEASURED = 'nothing was measured there; click where the map has features';

type Shape = 'plane' | 'box';

/** What is measured by clicks: a plane by three points, a box by two corners. */
export class ThingMeasure {
  private readonly points: ThingPoints;

  constructor(
    private readonly session: Session,
    colour: () => number,
  ) {
    this.points = new ThingPoints(session, colour);
  }

  get begun(): boolean {
    return this.points.inWorld.length > 0;
  }

  cancel(): void {
    this.points.clear();
  }

  hint(shape: Shape): string {
    const clicked = this.points.inWorld.length;
    if (shape === 'plane') {
      const next = ['one end of an edge', 'its other end', 'the opposite edge'][clicked];
      return `Plane, point ${clicked + 1} of 3: click ${next ?? ''}.`;
    }
    const corner = clicked === 0 ? 'a lower corner' : 'the opposite upper corner';
    return `Box, corner ${clicked + 1} of 2: click ${corner}.`;
  }

  /** Undefined: more points are wanted. Throws, in words, where there is none. */
  click(shape: Shape, { view, landing }: Spot, name: string): ThingDraft | undefined {
    if (landing?.how !== 'feature' && landing?.how !== 'plane') throw new Error(UNMEASURED);
    const { inWorld } = this.points;
    if (inWorld.some((point) => distance(point, landing.pointInWorld) < 1e-6)) {
      throw new Error('that is a point you clicked already');
    }
    this.points.add(landing.pointInWorld);
    const [a, b, c] = inWorld;
    if (!a || !b || (shape === 'plane' && !c)) return undefined;
    const made = c ? planeOf(a, b, c, eyeOf(view)) : boxOf(a, b, this.upright(view));
    this.points.clear();
    if (typeof made === 'string') throw new Error(made);
    return {
      ...{ name, shape, material: 'real', modelId: '', scale: 1, sizeM: made.sizeM },
      ...{ annotationId: '', parentFromObject: made.pose, colorRgba: 0 },
    };
  }

  /** As the room is turned, where there is one. */
  private upright(view: Spot['view']): Quaternion {
    const room = this.session.scene.things.find(({ shape }) => shape === 'room');
    return room?.parentFromObject.rotation ?? facing(wayInWorld(view, 'away'));
  }
}
