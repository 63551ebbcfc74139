import {
  add,
  cross,
  dot,
  norm,
  normalise,
  scale,
  subtract,
  type Vec3,
  ZERO,
} from '../geometry/vec3';
import { DOWN } from './thing_places';

/*
 * What is laid over a room to explain it (Koller et al. 1997, figure 7), as triangles in a thing's own frame:
 * x right, y down, z away [m]. Shapes as shared/models/overlay_things.cpp has them.
 */

/** Triangles of one colour, three corners each. */
export interface Part {
  readonly colour: readonly [number, number, number]; // linear, 0 to 1
  readonly corners: readonly Vec3[];
}

const SIDES = 12;
const LIFT_M = 0.004; // of what lies on a floor, above it
const LINE_M = 0.012;
const HEAD_EVERY_M = 0.42;
const LEVELS = 5; // of each colour of a picture, beside black

const quad = (a: Vec3, b: Vec3, c: Vec3, d: Vec3): Vec3[] => [a, b, c, a, c, d];

/** Round `axis` at `middle`. */
function ring(middle: Vec3, axis: Vec3, radiusM: number): Vec3[] {
  const other = Math.abs(axis.y) < 0.9 * norm(axis) ? DOWN : { x: 1, y: 0, z: 0 };
  const u = normalise(cross(axis, other));
  const v = normalise(cross(axis, u));
  return Array.from({ length: SIDES }, (_, k) => {
    const angle = (2 * Math.PI * k) / SIDES;
    const out = add(scale(u, Math.cos(angle)), scale(v, Math.sin(angle)));
    return add(middle, scale(out, radiusM));
  });
}

/** A frustum, closed at both ends. */
function frustum(from: Vec3, to: Vec3, radiusFrom: number, radiusTo: number): Vec3[] {
  const axis = subtract(to, from);
  const [first, last] = [ring(from, axis, radiusFrom), ring(to, axis, radiusTo)];
  return first.flatMap((a, k) => {
    const next = (k + 1) % SIDES;
    const [b = a, c = a, d = a] = [first[next], last[next], last[k]];
    return [...quad(a, b, c, d), from, b, a, to, d, c];
  });
}

/** A tube along a way of at least two points: a pipe, a cable; with balls at its bends. */
export function tubeOf(way: readonly Vec3[], radiusM: number): Vec3[] {
  return way.slice(1).flatMap((to, k) => {
    const from = way[k] ?? to;
    const piece = frustum(from, to, radiusM, radiusM);
    if (k === 0) return piece;
    const axis = scale(normalise(subtract(to, from)), radiusM);
    return [
      ...piece,
      ...frustum(subtract(from, axis), from, 0.5 * radiusM, 1.15 * radiusM),
      ...frustum(from, add(from, axis), 1.15 * radiusM, 0.5 * radiusM),
    ];
  });
}

/** Lines `stepM` apart on the floor, the middle of the field at the origin. */
export function gridOf(sizeXM: number, sizeZM: number, stepM: number): Vec3[] {
  const [x, z, h] = [sizeXM / 2, sizeZM / 2, LINE_M / 2];
  const at = (px: number, pz: number): Vec3 => ({ x: px, y: -LIFT_M, z: pz });
  const lines = (size: number): number[] =>
    Array.from({ length: Math.floor(size / stepM + 1e-6) + 1 }, (_, k) => k * stepM - size / 2);
  return [
    ...lines(sizeXM).flatMap((p) => quad(at(p - h, -z), at(p + h, -z), at(p + h, z), at(p - h, z))),
    ...lines(sizeZM).flatMap((p) => quad(at(-x, p - h), at(x, p - h), at(x, p + h), at(-x, p + h))),
  ];
}

/** A flat arrow head on the floor. */
function head(tip: Vec3, forward: Vec3, widthM: number): Vec3[] {
  const side = scale(cross(forward, DOWN), widthM / 2);
  const back = add(tip, scale(forward, -0.55 * widthM));
  const thick = scale(forward, -0.4 * widthM);
  const [left, right] = [add(back, side), subtract(back, side)];
  return [
    ...quad(tip, left, add(left, thick), add(tip, thick)),
    ...quad(tip, add(tip, thick), add(right, thick), right),
  ];
}

/** Arrow heads along a way on the floor, each pointing where it leads; the last one larger. */
export function routeOf(way: readonly Vec3[], widthM: number): Vec3[] {
  const corners: Vec3[] = [];
  const lifted = way.map((point) => ({ ...point, y: point.y - LIFT_M }));
  let next = HEAD_EVERY_M / 2;
  lifted.slice(1).forEach((to, k) => {
    const from = lifted[k] ?? to;
    const forward = normalise(subtract(to, from));
    const length = norm(subtract(to, from));
    for (; next < length; next += HEAD_EVERY_M) {
      corners.push(...head(add(from, scale(forward, next)), forward, widthM));
    }
    next -= length;
    if (k + 2 < lifted.length) return;
    corners.push(...head(add(to, scale(forward, 0.3 * widthM)), forward, 1.7 * widthM));
  });
  return corners;
}

/** An arrow with a round shaft. */
export function arrowOf(from: Vec3, to: Vec3, radiusM: number): Vec3[] {
  const neck = subtract(to, scale(normalise(subtract(to, from)), 5 * radiusM));
  return [
    ...frustum(from, neck, radiusM, radiusM),
    ...frustum(neck, to, 2.6 * radiusM, 0.02 * radiusM),
  ];
}

/** A picture that hangs, its middle at the origin, seen from -z: a square for each pixel that is seen. */
export function pictureOf(rgba: Uint8ClampedArray, columns: number, widthM: number): Part[] {
  const step = widthM / columns;
  const rows = rgba.length / 4 / columns;
  const parts = new Map<string, { colour: Part['colour']; corners: Vec3[] }>();
  for (let i = 0; i < columns * rows; ++i) {
    const [r = 0, g = 0, b = 0, a = 0] = rgba.subarray(4 * i, 4 * i + 4);
    if (a < 128) continue;
    const levels = [r, g, b].map((value) => Math.round((value / 255) * LEVELS));
    const linear = levels.map((level) => (level / LEVELS) ** 2.2);
    const part = parts.get(levels.join()) ?? {
      ...{ colour: [linear[0] ?? 0, linear[1] ?? 0, linear[2] ?? 0] as const, corners: [] },
    };
    parts.set(levels.join(), part);
    const x = ((i % columns) - columns / 2) * step;
    const y = (Math.floor(i / columns) - rows / 2) * step;
    const at = (dx: number, dy: number): Vec3 => ({ x: x + dx, y: y + dy, z: 0 });
    part.corners.push(...quad(at(0, 0), at(0, step), at(step, step), at(step, 0)));
  }
  return [...parts.values()];
}

/** The way from its first point, and that it is no point alone. */
export function wayFrom(points: readonly Vec3[]): { first: Vec3; offsets: Vec3[] } | undefined {
  const [first] = points;
  const far = points.some((point) => first && norm(subtract(point, first)) > 0.01);
  if (!first || !far) return undefined;
  return { first, offsets: points.map((point) => subtract(point, first)) };
}

/** From beside and above a place to the place itself, which is the origin; `normal` out of what is there. */
export function pointingFrom(normal: Vec3, lengthM: number): Vec3 {
  const out = dot(normal, DOWN) > 0.9 ? ZERO : normal;
  return scale(normalise(subtract(out, scale(DOWN, 0.8))), lengthM);
}
