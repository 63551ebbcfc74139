import type { Quaternion, Rigid3 } from './rigid3';
import { multiply } from './rigid3';
import type { Vec3 } from './vec3';

/*
 * The only place that knows three.js' axes. Ours: x right, y down, z forward (world and camera).
 * three.js: x right, y up, z backward. One half turn about x takes either into the other.
 */

/** A world point or vector as three.js wants it. */
export const threeFromWorld = (p: Vec3): Vec3 => ({ x: p.x, y: -p.y, z: -p.z });

/** And back. */
export const worldFromThree = (p: Vec3): Vec3 => ({ x: p.x, y: -p.y, z: -p.z });

/** Orientation of an object whose own axes are three.js', e.g. a camera that looks along -z. */
export function threeOrientation(worldFromObject: Rigid3): Quaternion {
  const halfTurn = { x: 1, y: 0, z: 0, w: 0 };
  return multiply(multiply(halfTurn, worldFromObject.rotation), { x: -1, y: 0, z: 0, w: 0 });
}
