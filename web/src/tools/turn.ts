import { multiply, type Quaternion, rotate } from '../geometry/rigid3';
import { add, cross, dot, norm, normalise, scale, subtract, type Vec3 } from '../geometry/vec3';
import { eyeOf, type View } from '../geometry/view';
import { rayOf } from '../geometry/view';
import type { Pixel } from '../geometry/vec3';

export const NO_TURN: Quaternion = { x: 0, y: 0, z: 0, w: 1 };

/** About a unit axis. */
export function about(axis: Vec3, angleRad: number): Quaternion {
  const v = scale(axis, Math.sin(angleRad / 2));
  return { ...v, w: Math.cos(angleRad / 2) };
}

const unit = (q: Quaternion): Quaternion => {
  const length = Math.hypot(q.x, q.y, q.z, q.w);
  return { x: q.x / length, y: q.y / length, z: q.z / length, w: q.w / length };
};

/** The shortest turn of one unit vector into another. */
export function between(from: Vec3, to: Vec3): Quaternion {
  const w = 1 + dot(from, to);
  if (w > 1e-6) return unit({ ...cross(from, to), w });
  const other = Math.abs(from.x) < 0.9 ? { x: 1, y: 0, z: 0 } : { x: 0, y: 1, z: 0 };
  return { ...normalise(cross(from, other)), w: 0 };
}

/** Where the handle of a mark turned so points, from its anchor. */
export const handleDirection = (worldFromMark: Quaternion | undefined): Vec3 =>
  rotate(worldFromMark ?? NO_TURN, { x: 0, y: -1, z: 0 });

/**
 * Turned so that the handle, `lengthM` from the anchor, lies under `pixel`: on the near half of its sphere if
 * it was there before, else on the far one; beyond its rim, towards the pixel.
 */
export function turnedTo(
  view: View,
  pixel: Pixel,
  anchorInWorld: Vec3,
  lengthM: number,
  worldFromMark: Quaternion | undefined,
): Quaternion | undefined {
  const ray = rayOf(view, pixel);
  if (!ray) return undefined;
  const before = handleDirection(worldFromMark);
  const towards = normalise(ray);
  const eye = eyeOf(view);
  const nearest = add(eye, scale(towards, dot(subtract(anchorInWorld, eye), towards)));
  const off = subtract(nearest, anchorInWorld);
  const rest = lengthM * lengthM - dot(off, off);
  const side = dot(before, towards) > 0 ? 1 : -1;
  const after = rest > 0 ? add(off, scale(towards, side * Math.sqrt(rest))) : off;
  if (norm(after) < 1e-9) return undefined;
  return unit(multiply(between(before, normalise(after)), worldFromMark ?? NO_TURN));
}

/** Turned by an angle in the plane of the picture, or tipped towards the eye. */
export function turnedBy(
  view: View,
  worldFromMark: Quaternion | undefined,
  angleRad: number,
  tips: boolean,
): Quaternion {
  const axis = tips ? { x: 1, y: 0, z: 0 } : { x: 0, y: 0, z: 1 };
  const inWorld = rotate(view.worldFromCamera.rotation, axis);
  return unit(multiply(about(inWorld, angleRad), worldFromMark ?? NO_TURN));
}
