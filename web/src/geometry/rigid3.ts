import { add, cross, mix, scale, type Vec3 } from './vec3';

/** Hamilton, x y z w, unit length. */
export interface Quaternion {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly w: number;
}

/** A rigid transform: point_in_target = rotation * point_in_source + translation. */
export interface Rigid3 {
  readonly rotation: Quaternion;
  readonly translation: Vec3;
}

export const IDENTITY: Rigid3 = {
  rotation: { x: 0, y: 0, z: 0, w: 1 },
  translation: { x: 0, y: 0, z: 0 },
};

export function rotate(q: Quaternion, v: Vec3): Vec3 {
  const t = scale(cross(q, v), 2);
  return add(add(v, scale(t, q.w)), cross(q, t));
}

export const conjugate = (q: Quaternion): Quaternion => ({ x: -q.x, y: -q.y, z: -q.z, w: q.w });

export function multiply(a: Quaternion, b: Quaternion): Quaternion {
  return {
    x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
    y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
    z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
    w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
  };
}

/** targetFromSource * pointInSource. */
export const transform = (targetFromSource: Rigid3, point: Vec3): Vec3 =>
  add(rotate(targetFromSource.rotation, point), targetFromSource.translation);

export function inverse(a: Rigid3): Rigid3 {
  const rotation = conjugate(a.rotation);
  return { rotation, translation: scale(rotate(rotation, a.translation), -1) };
}

/** aFromB, bFromC -> aFromC. */
export function compose(a: Rigid3, b: Rigid3): Rigid3 {
  return { rotation: multiply(a.rotation, b.rotation), translation: transform(a, b.translation) };
}

/** A fraction `t` of the way from `a` to `b`, the short way round. */
export function between(a: Rigid3, b: Rigid3, t: number): Rigid3 {
  const [p, q] = [a.rotation, b.rotation];
  const near = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w < 0 ? -1 : 1;
  const of = (axis: keyof Quaternion): number => (1 - t) * p[axis] + near * t * q[axis];
  const [x, y, z, w] = [of('x'), of('y'), of('z'), of('w')];
  const length = Math.hypot(x, y, z, w) || 1;
  const rotation = { x: x / length, y: y / length, z: z / length, w: w / length };
  return { rotation, translation: mix(a.translation, b.translation, t) };
}
