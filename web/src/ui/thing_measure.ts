import type { Quaternion } from '../geometry/rigid3';
import { distance } from '../geometry/vec3';
import { eyeOf } from '../geometry/view';
import type { ThingDraft } from '../session/scene_edits';
import type { Session } from '../session/session';
import { boxOf, facing, type Measured, planeOf, roomOf, wayInWorld } from '../tools/thing_places';
import { ThingPoints } from './thing_points';
import type { Spot } from './thing_spot';

/** Of a room by clicks, which has its ceiling where nobody looks; its numbers can be changed. */
export const ROOM_HEIGHT_M = 2.5;

export const UNMEASURED = 'nothing was measured there; click where the map has features';

export type Measurement = 'plane' | 'box' | 'room';
export const isMeasured = (does: string): does is Measurement =>
  ['plane', 'box', 'room'].includes(does);

const ROOM_STEPS = [
  'a point of the floor',
  'a point of one wall',
  'another point of that wall, beside the first',
  'the wall at its left',
  'the wall at its right',
  'the wall opposite',
];

/** What is measured by clicks: a plane by three points, a box by two corners, a room by six points. */
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

  hint(shape: Measurement): string {
    const clicked = this.points.inWorld.length;
    if (shape === 'plane') {
      const next = ['one end of an edge', 'its other end', 'the opposite edge'][clicked];
      return `Plane, point ${clicked + 1} of 3: click ${next ?? ''}.`;
    }
    if (shape === 'room') {
      return `Room, point ${clicked + 1} of ${ROOM_STEPS.length}: click ${ROOM_STEPS[clicked] ?? ''}.`;
    }
    const corner = clicked === 0 ? 'a lower corner' : 'the opposite upper corner';
    return `Box, corner ${clicked + 1} of 2: click ${corner}.`;
  }

  /** Undefined: more points are wanted. Throws, in words, where there is none. */
  click(shape: Measurement, { view, landing }: Spot, name: string): ThingDraft | undefined {
    if (landing?.how !== 'feature' && landing?.how !== 'plane') throw new Error(UNMEASURED);
    const { inWorld } = this.points;
    if (inWorld.some((point) => distance(point, landing.pointInWorld) < 1e-6)) {
      throw new Error('that is a point you clicked already');
    }
    this.points.add(landing.pointInWorld);
    const made = this.made(shape, view);
    if (made === undefined) return undefined;
    this.points.clear();
    if (typeof made === 'string') throw new Error(made);
    return {
      ...{ name, shape, material: 'real', modelId: '', scale: 1, sizeM: made.sizeM },
      ...{ annotationId: '', marker: undefined, parentFromObject: made.pose, colorRgba: 0 },
    };
  }

  /** Undefined: more points are wanted; a text: why there is none. */
  private made(shape: Measurement, view: Spot['view']): Measured | string | undefined {
    const [a, b, c, ...more] = this.points.inWorld;
    if (!a || !b) return undefined;
    if (shape === 'box') return boxOf(a, b, this.upright(view));
    if (!c) return undefined;
    if (shape === 'plane') return planeOf(a, b, c, eyeOf(view));
    const [left, right, opposite] = more;
    if (!left || !right || !opposite) return undefined;
    return roomOf({ floor: a, wall: [b, c], sides: [left, right], opposite }, ROOM_HEIGHT_M);
  }

  /** As the room is turned, where there is one. */
  private upright(view: Spot['view']): Quaternion {
    const room = this.session.scene.things.find(({ shape }) => shape === 'room');
    return room?.parentFromObject.rotation ?? facing(wayInWorld(view, 'away'));
  }
}
