import { determinant, Matrix, SVD } from 'ml-matrix';

// Projection through the camera's lens, written anew: the test does not trust the page's own.

/** Rotates v by a unit quaternion [x, y, z, w]. */
export function rotate([x, y, z, w], [a, b, c]) {
  const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [
    a + w * t[0] + y * t[2] - z * t[1],
    b + w * t[1] + z * t[0] - x * t[2],
    c + w * t[2] + x * t[1] - y * t[0],
  ];
}

const inverseOf = ([x, y, z, w]) => [-x, -y, -z, w];
export const minus = (a, b) => a.map((value, i) => value - b[i]);
export const plus = (a, b) => a.map((value, i) => value + b[i]);
export const times = (a, s) => a.map((value) => value * s);
export const length = (a) => Math.hypot(...a);

/** Pose as in --sim-truth: {rotation_xyzw, translation_m} of world_from_camera. */
export const inCamera = (pose, point) =>
  rotate(inverseOf(pose.rotation_xyzw), minus(point, pose.translation_m));

export const inWorld = (pose, point) => plus(rotate(pose.rotation_xyzw, point), pose.translation_m);

function distort(camera, x, y) {
  const [k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0] = camera.distortion;
  const s = x * x + y * y;
  const f = 1 + k1 * s + k2 * s * s + k3 * s * s * s;
  return [
    x * f + 2 * p1 * x * y + p2 * (s + 2 * x * x),
    y * f + p1 * (s + 2 * y * y) + 2 * p2 * x * y,
  ];
}

/** Pixel of a point in the camera, brown_conrady or pinhole; undefined behind it. */
export function project(camera, [x, y, z]) {
  if (z <= 0) return undefined;
  const [u, v] = distort(camera, x / z, y / z);
  return [camera.fxPx * u + camera.cxPx, camera.fyPx * v + camera.cyPx];
}

/** The point at depth z whose pixel this is, by fixed-point iteration. */
export function unproject(camera, [u, v], z) {
  const wanted = [(u - camera.cxPx) / camera.fxPx, (v - camera.cyPx) / camera.fyPx];
  let at = wanted;
  for (let i = 0; i < 100; ++i) at = plus(at, minus(wanted, distort(camera, ...at)));
  return [at[0] * z, at[1] * z, z];
}

/**
 * Pixels along the 12 edges of a cube about a point, axes parallel to world, evenly spread; nothing
 * unless all its corners are at least `border` px inside the picture.
 */
export function cubePixels(camera, pose, centre, size, border) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => {
    const offset = [i & 1, i & 2, i & 4].map((bit) => (bit ? size / 2 : -size / 2));
    return project(camera, inCamera(pose, plus(centre, offset)));
  });
  const inside = ([u, v]) =>
    u > border && v > border && u < camera.widthPx - border && v < camera.heightPx - border;
  if (!corners.every((corner) => corner && inside(corner))) return [];
  const out = [];
  for (let i = 0; i < 8; ++i) {
    for (const bit of [1, 2, 4]) {
      if (i & bit) continue;
      const a = corners[i];
      const b = corners[i | bit];
      const steps = Math.max(2, Math.ceil(2 * length(minus(a, b))));
      for (let k = 0; k <= steps; ++k) out.push(plus(times(a, 1 - k / steps), times(b, k / steps)));
    }
  }
  return out;
}

/** The similarity that takes points `from` nearest to points `to` (least squares; Umeyama 1991, eq. 40 to 42). */
export function similarity(from, to) {
  const centreOf = (points) => times(points.reduce(plus), 1 / points.length);
  const [a, b] = [centreOf(from), centreOf(to)];
  const away = (points, centre) => new Matrix(points.map((point) => minus(point, centre)));
  const [A, B] = [away(from, a), away(to, b)];
  const svd = new SVD(B.transpose().mmul(A));
  const [U, V] = [svd.leftSingularVectors, svd.rightSingularVectors];
  const S = Matrix.diag([1, 1, Math.sign(determinant(U) * determinant(V))]);
  const R = U.mmul(S).mmul(V.transpose());
  const scale = S.mmul(Matrix.diag(svd.diagonal)).trace() / A.norm() ** 2;
  return (point) => plus(times(R.mmul(Matrix.columnVector(minus(point, a))).to1DArray(), scale), b);
}
