import type { Quaternion } from '../geometry/rigid3';
import { conjugate, rotate } from '../geometry/rigid3';
import { mix, subtract, type Vec3 } from '../geometry/vec3';
import type { View } from '../geometry/view';
import { about } from './turn';

const LEAST_M = 0.01;
const MOST_M = 10; // annotation.proto

export interface DrawnBox {
  readonly middleInWorld: Vec3;
  readonly worldFromMark: Quaternion;
  readonly extentM: Vec3;
}

/** Upright, its x axis to the right as the eye sees it. */
export function uprightFor({ worldFromCamera }: View): Quaternion {
  const right = rotate(worldFromCamera.rotation, { x: 1, y: 0, z: 0 });
  return about({ x: 0, y: 1, z: 0 }, Math.atan2(-right.z, right.x));
}

/** From one corner to the other; as deep as the less wide of its sides where they lie in a plane. */
export function boxBetween(view: View, a: Vec3, b: Vec3): DrawnBox {
  const worldFromMark = uprightFor(view);
  const d = rotate(conjugate(worldFromMark), subtract(b, a));
  const sides = [Math.abs(d.x), Math.abs(d.y), Math.abs(d.z)].sort((p, q) => p - q);
  const depth = (sides[0] ?? 0) < 0.25 * (sides[1] ?? 0) ? (sides[1] ?? 0) / 2 : 0;
  const side = (length: number): number =>
    Math.min(Math.max(Math.abs(length), depth, LEAST_M), MOST_M);
  const extentM = { x: side(d.x), y: side(d.y), z: side(d.z) };
  return { middleInWorld: mix(a, b, 0.5), worldFromMark, extentM };
}
