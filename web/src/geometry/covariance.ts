import type { Camera } from './camera';
import { type Rigid3, transform } from './rigid3';
import type { Vec3 } from './vec3';

/** Upper triangle of a symmetric 3 x 3 matrix: xx xy xz yy yz zz. */
export type Covariance3 = readonly [number, number, number, number, number, number];

/** One axis of an ellipsoid: direction times one standard deviation. */
export type Axis = Vec3;

export function covariance3(upper: readonly number[]): Covariance3 | undefined {
  const [xx, xy, xz, yy, yz, zz] = upper;
  if (xx === undefined || xy === undefined || xz === undefined) return undefined;
  if (yy === undefined || yz === undefined || zz === undefined) return undefined;
  return [xx, xy, xz, yy, yz, zz];
}

/** The three principal axes, longest first, each one standard deviation long (Jacobi rotations). */
export function principalAxes(covariance: Covariance3): [Axis, Axis, Axis] {
  const [xx, xy, xz, yy, yz, zz] = covariance;
  const a = [
    [xx, xy, xz],
    [xy, yy, yz],
    [xz, yz, zz],
  ];
  const v = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  const at = (m: number[][], i: number, j: number): number => m[i]?.[j] ?? 0;
  const set = (m: number[][], i: number, j: number, value: number): void => {
    const row = m[i];
    if (row) row[j] = value;
  };
  for (let sweep = 0; sweep < 20; ++sweep) {
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ] as const) {
      const apq = at(a, p, q);
      if (Math.abs(apq) < 1e-18) continue;
      const theta = (at(a, q, q) - at(a, p, p)) / (2 * apq);
      const t = (theta >= 0 ? 1 : -1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
      const c = 1 / Math.sqrt(t * t + 1);
      const s = t * c;
      for (const m of [a, v]) {
        for (let k = 0; k < 3; ++k) {
          const mkp = at(m, k, p);
          const mkq = at(m, k, q);
          set(m, k, p, c * mkp - s * mkq);
          set(m, k, q, s * mkp + c * mkq);
        }
      }
      for (let k = 0; k < 3; ++k) {
        const apk = at(a, p, k);
        const aqk = at(a, q, k);
        set(a, p, k, c * apk - s * aqk);
        set(a, q, k, s * apk + c * aqk);
      }
    }
  }
  const axes = [0, 1, 2].map((k) => {
    const sigma = Math.sqrt(Math.max(at(a, k, k), 0));
    return {
      sigma,
      axis: { x: at(v, 0, k) * sigma, y: at(v, 1, k) * sigma, z: at(v, 2, k) * sigma },
    };
  });
  axes.sort((l, r) => r.sigma - l.sigma);
  const [first, second, third] = axes.map((entry) => entry.axis);
  const none = { x: 0, y: 0, z: 0 };
  return [first ?? none, second ?? none, third ?? none];
}

/** Standard deviation along the longest axis. */
export function largestSigma(covariance: Covariance3): number {
  const [axis] = principalAxes(covariance);
  return Math.hypot(axis.x, axis.y, axis.z);
}

/** Axes [px] of the one-sigma ellipse that a point's covariance draws in the picture. */
export function imageEllipse(
  camera: Camera,
  cameraFromWorld: Rigid3,
  pointInWorld: Vec3,
  covariance: Covariance3,
): { u: number; v: number }[] | undefined {
  const centre = camera.project(transform(cameraFromWorld, pointInWorld));
  if (!centre) return undefined;
  let uu = 0;
  let uv = 0;
  let vv = 0;
  for (const axis of principalAxes(covariance)) {
    const h = 1e-3; // of a sigma: the derivative, not the far end
    const moved = camera.project(
      transform(cameraFromWorld, {
        x: pointInWorld.x + axis.x * h,
        y: pointInWorld.y + axis.y * h,
        z: pointInWorld.z + axis.z * h,
      }),
    );
    if (!moved) continue;
    const du = (moved.u - centre.u) / h;
    const dv = (moved.v - centre.v) / h;
    uu += du * du;
    uv += du * dv;
    vv += dv * dv;
  }
  const mean = (uu + vv) / 2;
  const spread = Math.hypot((uu - vv) / 2, uv);
  const angle = Math.atan2(2 * uv, uu - vv) / 2;
  const long = Math.sqrt(Math.max(mean + spread, 0));
  const short = Math.sqrt(Math.max(mean - spread, 0));
  return [
    { u: long * Math.cos(angle), v: long * Math.sin(angle) },
    { u: -short * Math.sin(angle), v: short * Math.cos(angle) },
  ];
}
