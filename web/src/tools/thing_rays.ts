import { conjugate, inverse, rotate, transform } from '../geometry/rigid3';
import { add, scale, type Vec3 } from '../geometry/vec3';
import type { Model, Thing } from '../session/scene_book';
import { isFixed } from '../session/thing_place';

export interface Ray {
  readonly originInWorld: Vec3;
  readonly directionInWorld: Vec3;
}

export interface Hit {
  readonly thing: Thing;
  readonly pointInWorld: Vec3;
  readonly normalInWorld: Vec3; // unit, towards where the ray comes from
  readonly along: number; // in lengths of the direction
}

interface LocalHit {
  readonly along: number;
  readonly normal: Vec3;
}

const AXES = ['x', 'y', 'z'] as const;

/** A box on its base: where the ray goes in, or of a room where it goes out. */
function hitBox(o: Vec3, d: Vec3, size: Vec3, fromInside: boolean): LocalHit | undefined {
  const low = { x: -size.x / 2, y: -size.y, z: -size.z / 2 };
  const high = { x: size.x / 2, y: 0, z: size.z / 2 };
  let [enter, leave] = [-Infinity, Infinity];
  let [enterAxis, leaveAxis]: (typeof AXES)[number][] = ['x', 'x'];
  for (const axis of AXES) {
    if (Math.abs(d[axis]) < 1e-12) {
      if (o[axis] < low[axis] || o[axis] > high[axis]) return undefined;
      continue;
    }
    const ends = [(low[axis] - o[axis]) / d[axis], (high[axis] - o[axis]) / d[axis]] as const;
    const [near, far] = [Math.min(...ends), Math.max(...ends)];
    if (near > enter) [enter, enterAxis] = [near, axis];
    if (far < leave) [leave, leaveAxis] = [far, axis];
  }
  if (enter > leave) return undefined;
  const [along, axis] = fromInside ? [leave, leaveAxis] : [enter, enterAxis];
  if (along <= 0 || axis === undefined) return undefined;
  const normal = { x: 0, y: 0, z: 0, [axis]: d[axis] > 0 ? -1 : 1 };
  return { along, normal };
}

function hitPlane(o: Vec3, d: Vec3, size: Vec3): LocalHit | undefined {
  if (Math.abs(d.y) < 1e-12) return undefined;
  const along = -o.y / d.y;
  const at = add(o, scale(d, along));
  if (along <= 0 || Math.abs(at.x) > size.x / 2 || Math.abs(at.z) > size.z / 2) return undefined;
  return { along, normal: { x: 0, y: d.y > 0 ? -1 : 1, z: 0 } };
}

function hitOne(thing: Thing, ray: Ray, boxM: Vec3): Hit | undefined {
  const { parentFromObject: pose, shape } = thing;
  const o = transform(inverse(pose), ray.originInWorld);
  const d = rotate(conjugate(pose.rotation), ray.directionInWorld);
  const hit = shape === 'plane' ? hitPlane(o, d, boxM) : hitBox(o, d, boxM, shape === 'room');
  if (!hit) return undefined;
  const { along } = hit;
  const pointInWorld = add(ray.originInWorld, scale(ray.directionInWorld, along));
  return { thing, along, pointInWorld, normalInWorld: rotate(pose.rotation, hit.normal) };
}

const nearest = (hits: readonly (Hit | undefined)[]): Hit | undefined =>
  hits.reduce((best, hit) => (hit && (!best || hit.along < best.along) ? hit : best), undefined);

/** The first surface of what stops things; of models, whose triangles this page leaves to the server, none. */
export const hitSurface = (things: readonly Thing[], ray: Ray): Hit | undefined =>
  nearest(
    things
      .filter((thing) => {
        const solid = thing.material === 'real' || thing.material === 'virtual';
        return solid && thing.shape !== 'model' && !isFixed(thing);
      })
      .map((thing) => hitOne(thing, ray, thing.sizeM)),
  );

/** The thing whose box is there; rooms, in which everything is, are none. */
export const pickThing = (
  things: readonly Thing[],
  models: readonly Model[],
  ray: Ray,
): Thing | undefined =>
  nearest(
    things
      .filter((thing) => thing.shape !== 'room' && !isFixed(thing))
      .map((thing) => hitOne(thing, ray, sizeOf(thing, models))),
  )?.thing;

/** Of its box [m]. */
export function sizeOf(thing: Thing, models: readonly Model[]): Vec3 {
  const model = models.find(({ id }) => id === thing.modelId);
  return model ? scale(model.sizeM, thing.scale) : thing.sizeM;
}

/** The corners of what is no model, in its own frame. */
export function cornersOf({ shape, sizeM: { x, y, z } }: Thing): Vec3[] {
  const corners: Vec3[] = [];
  for (const height of shape === 'plane' ? [0] : [0, y]) {
    for (const [sx, sz] of [
      [-1, -1],
      [1, -1],
      [1, 1],
      [-1, 1],
    ] as const) {
      corners.push({ x: (sx * x) / 2, y: -height, z: (sz * z) / 2 });
    }
  }
  return corners;
}
