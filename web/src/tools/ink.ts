import { type Plane, intersect } from '../geometry/plane';
import { rotate } from '../geometry/rigid3';
import { pixelDistance, type Pixel, type Vec3 } from '../geometry/vec3';
import { eyeOf, rayOf, type View } from '../geometry/view';
import type { Landing } from './landing';

const STEP_PX = 1.5; // CSS px between points
const MIN_CUTOFF_HZ = 2.5;
const BETA = 0.03; // Hz for each px/s: a fast hand means what it does
const SPEED_CUTOFF_HZ = 1;

const share = (cutoffHz: number, seconds: number): number => {
  const r = 2 * Math.PI * cutoffHz * seconds;
  return r / (r + 1);
};

/**
 * Smooths a hand: still where it is slow, close behind where it is fast. Casiez, Roussel, Vogel: "1 € filter",
 * CHI 2012.
 */
export class Smoother {
  private at: Pixel | undefined;
  private speed: Pixel = { u: 0, v: 0 };
  private timeMs = 0;

  add(raw: Pixel, timeMs: number): Pixel {
    const { at } = this;
    const seconds = Math.max(timeMs - this.timeMs, 1) / 1000;
    this.timeMs = timeMs;
    if (!at) return (this.at = raw);
    const a = share(SPEED_CUTOFF_HZ, seconds);
    this.speed = {
      u: this.speed.u + a * ((raw.u - at.u) / seconds - this.speed.u),
      v: this.speed.v + a * ((raw.v - at.v) / seconds - this.speed.v),
    };
    const cutoff = MIN_CUTOFF_HZ + BETA * Math.hypot(this.speed.u, this.speed.v);
    const b = share(cutoff, seconds);
    this.at = { u: at.u + b * (raw.u - at.u), v: at.v + b * (raw.v - at.v) };
    return this.at;
  }
}

/** True where a point adds nothing to a line that ends at `last`. */
export const isTooNear = (last: Pixel | undefined, next: Pixel): boolean =>
  last !== undefined && pixelDistance(last, next) < STEP_PX;

/** The plane a stroke lies in: the surface that was clicked, or one that faces the eye. */
export function planeOf(landing: Landing, view: View): Plane {
  const facing = rotate(view.worldFromCamera.rotation, { x: 0, y: 0, z: 1 });
  return { point: landing.pointInWorld, normal: landing.normalInWorld ?? facing, residual: 0 };
}

/** Where a pixel's ray meets a stroke's plane. */
export function onPlane(view: View, plane: Plane, pixel: Pixel): Vec3 | undefined {
  const direction = rayOf(view, pixel);
  return direction && intersect(plane, eyeOf(view), direction);
}

/**
 * The indices of a line's points that are needed so that none is farther off than `tolerancePx`
 * (Douglas, Peucker 1973), first and last included.
 */
export function needed(points: readonly Pixel[], tolerancePx: number): number[] {
  if (points.length < 3) return points.map((_, i) => i);
  const keep = new Set([0, points.length - 1]);
  const open: [number, number][] = [[0, points.length - 1]];
  for (let span = open.pop(); span; span = open.pop()) {
    const [from, to] = span;
    let worst = tolerancePx;
    let at = -1;
    for (let i = from + 1; i < to; ++i) {
      const away = distanceFromPiece(points[i], points[from], points[to]);
      if (away > worst) [worst, at] = [away, i];
    }
    if (at < 0) continue;
    keep.add(at);
    open.push([from, at], [at, to]);
  }
  return [...keep].sort((a, b) => a - b);
}

/** From the piece of line between `a` and `b` [px]. */
export function distanceFromPiece(
  p: Pixel | undefined,
  a: Pixel | undefined,
  b: Pixel | undefined,
): number {
  if (!p || !a || !b) return Infinity;
  const [du, dv] = [b.u - a.u, b.v - a.v];
  const squared = du * du + dv * dv;
  const t = squared > 0 ? ((p.u - a.u) * du + (p.v - a.v) * dv) / squared : 0;
  const along = Math.min(Math.max(t, 0), 1);
  return Math.hypot(p.u - a.u - along * du, p.v - a.v - along * dv);
}
