import type { Camera } from './camera';
import { type Rigid3, transform } from './rigid3';
import { mix, type Pixel, type Vec3 } from './vec3';

const NEAR_M = 0.02;
const MAX_BEND_PX = 0.25;
const BORDER_PX = 32;
const SHORT_PX = 6;
const MAX_DEPTH = 8;

/**
 * A polyline in world as it appears through the lens: cut at the near plane (2 cm), divided until
 * no piece bends by more than 0.25 px, cut where it leaves the picture by more than 32 px.
 * The server's `ProjectPolyline` has the same limits.
 */
export function projectPolyline(
  camera: Camera,
  cameraFromWorld: Rigid3,
  pointsInWorld: readonly Vec3[],
): Pixel[][] {
  const points = pointsInWorld.map((point) => transform(cameraFromWorld, point));
  const out: Pixel[][] = [];
  let current: Pixel[] = [];
  const close = (): void => {
    if (current.length > 1) out.push(current);
    current = [];
  };
  for (let i = 1; i < points.length; ++i) {
    const piece = cutAtNear(points[i - 1], points[i]);
    if (!piece) {
      close();
      continue;
    }
    if (piece[0] !== points[i - 1]) close();
    for (const pixel of samples(camera, piece[0], piece[1])) {
      if (pixel && camera.inImage(pixel, -BORDER_PX)) {
        const last = current.at(-1);
        if (last?.u !== pixel.u || last.v !== pixel.v) current.push(pixel);
      } else {
        close();
      }
    }
    if (piece[1] !== points[i]) close();
  }
  close();
  return out;
}

function cutAtNear(a: Vec3 | undefined, b: Vec3 | undefined): [Vec3, Vec3] | undefined {
  if (!a || !b || (a.z < NEAR_M && b.z < NEAR_M)) return undefined;
  if (a.z >= NEAR_M && b.z >= NEAR_M) return [a, b];
  const cut = mix(a, b, (NEAR_M - a.z) / (b.z - a.z));
  return a.z < NEAR_M ? [cut, b] : [a, cut];
}

/** Pixels along a segment, close enough together that straight lines between them will do. */
function samples(camera: Camera, a: Vec3, b: Vec3): (Pixel | undefined)[] {
  const out: (Pixel | undefined)[] = [camera.project(a)];
  const divide = (p: Vec3, q: Vec3, depth: number): void => {
    const start = camera.project(p);
    const end = camera.project(q);
    if (depth < MAX_DEPTH && needsDivision(camera, p, q, start, end)) {
      const middle = mix(p, q, 0.5);
      divide(p, middle, depth + 1);
      divide(middle, q, depth + 1);
    } else {
      out.push(end);
    }
  };
  divide(a, b, 0);
  return out;
}

function needsDivision(
  camera: Camera,
  p: Vec3,
  q: Vec3,
  start: Pixel | undefined,
  end: Pixel | undefined,
): boolean {
  if (!start || !end) return start !== end; // one end only: find where it is lost
  const inside = camera.inImage(start, -BORDER_PX);
  if (inside !== camera.inImage(end, -BORDER_PX)) return true;
  // Nothing to look for: straight lines stay straight, and a short one has no room to bend.
  if (inside && (camera.straight || isShort(start, end))) return false;
  // Quarters as well: a bend with its turning point in the middle would hide there. Perspective
  // moves points along the line, so what counts is their distance from it.
  for (const t of [0.25, 0.5, 0.75]) {
    const on = camera.project(mix(p, q, t));
    if (!on || distanceFromLine(on, start, end) > MAX_BEND_PX) return true;
    if (!inside && camera.inImage(on, -BORDER_PX)) return true;
  }
  return false;
}

const isShort = (a: Pixel, b: Pixel): boolean =>
  Math.abs(a.u - b.u) + Math.abs(a.v - b.v) < SHORT_PX;

function distanceFromLine(p: Pixel, a: Pixel, b: Pixel): number {
  const du = b.u - a.u;
  const dv = b.v - a.v;
  const length = Math.hypot(du, dv);
  if (length < 1e-9) return Math.hypot(p.u - a.u, p.v - a.v);
  return Math.abs(du * (p.v - a.v) - dv * (p.u - a.u)) / length;
}
