import { principalAxes, type Covariance3 } from './covariance';
import { add, dot, normalise, scale, subtract, type Vec3, ZERO } from './vec3';

export interface Plane {
  readonly point: Vec3;
  readonly normal: Vec3;
  /** Root mean square distance of the points from the plane [m]. */
  readonly residual: number;
}

/** Least-squares plane through at least three points; undefined if they lie on a line. */
export function fitPlane(points: readonly Vec3[]): Plane | undefined {
  if (points.length < 3) return undefined;
  const centre = scale(
    points.reduce((sum, p) => add(sum, p), ZERO),
    1 / points.length,
  );
  const moments = [0, 0, 0, 0, 0, 0];
  for (const p of points) {
    const d = subtract(p, centre);
    [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z].forEach((value, i) => {
      moments[i] = (moments[i] ?? 0) + value / points.length;
    });
  }
  const [, middle, shortest] = principalAxes(moments as unknown as Covariance3);
  const spread = Math.hypot(middle.x, middle.y, middle.z);
  if (spread < 1e-6) return undefined;
  const residual = Math.hypot(shortest.x, shortest.y, shortest.z);
  const normal = residual > 0 ? normalise(shortest) : normalFrom(points[0] ?? ZERO, points, centre);
  return { point: centre, normal, residual };
}

/** For points exactly in a plane, whose shortest axis has no length to read a direction from. */
function normalFrom(origin: Vec3, points: readonly Vec3[], centre: Vec3): Vec3 {
  let best = ZERO;
  for (const p of points) {
    const a = subtract(origin, centre);
    const b = subtract(p, centre);
    const n = { x: a.y * b.z - a.z * b.y, y: a.z * b.x - a.x * b.z, z: a.x * b.y - a.y * b.x };
    if (dot(n, n) > dot(best, best)) best = n;
  }
  return normalise(best);
}

/** Where a ray meets a plane in front of its origin. */
export function intersect(plane: Plane, origin: Vec3, direction: Vec3): Vec3 | undefined {
  const along = dot(direction, plane.normal);
  if (Math.abs(along) < 1e-3) return undefined;
  const t = dot(subtract(plane.point, origin), plane.normal) / along;
  return t > 0 ? add(origin, scale(direction, t)) : undefined;
}
