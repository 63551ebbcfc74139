import type { Quaternion, Rigid3 } from '../geometry/rigid3';
import { conjugate, rotate } from '../geometry/rigid3';
import {
  add,
  cross,
  dot,
  mix,
  norm,
  normalise,
  scale,
  subtract,
  type Vec3,
} from '../geometry/vec3';
import type { View } from '../geometry/view';
import { about } from './turn';

/* Gravity is +y of the world, as docs/scene.md has it. A thing's own frame: x right, y down, z away. */

export const DOWN: Vec3 = { x: 0, y: 1, z: 0 };
export const LEAST_SIDE_M = 0.01;
const RAISED_M = 0.3; // where a thing is let go above a click: what was clicked is known to centimetres

const level = ({ x, z }: Vec3): Vec3 => normalise({ x, y: 0, z });

/** Upright, its z axis along the level part of a direction. */
export const facing = (direction: Vec3): Quaternion =>
  about(DOWN, Math.atan2(direction.x, direction.z));

/** How far its z axis is turned from the world's, about the vertical [deg], in (-180, 180]. */
export function turnDeg({ rotation }: Rigid3): number {
  const z = rotate(rotation, { x: 0, y: 0, z: 1 });
  const deg = (Math.atan2(z.x, z.z) * 180) / Math.PI;
  return deg <= -180 + 1e-9 ? 180 : deg;
}

/** Where a thing is let go that is to stand where `clicked` is, its front to whoever looks. */
export const aboveFloor = (clicked: Vec3, sight: Vec3): Rigid3 => ({
  rotation: facing(sight),
  translation: subtract(clicked, scale(DOWN, RAISED_M)),
});

/**
 * Where a thing begins that is to be pushed to the wall at `clicked`, its back to it, and which way.
 * `floorY` [m]: of what lies under it, where that is known.
 */
export function beforeWall(
  clicked: Vec3,
  normalInWorld: Vec3,
  sight: Vec3,
  depthM: number,
  floorY: number | undefined,
): { start: Rigid3; push: Vec3 } {
  const steep = Math.hypot(normalInWorld.x, normalInWorld.z) > 0.3;
  const towards = level(steep ? normalInWorld : sight);
  const into = dot(towards, sight) < 0 ? scale(towards, -1) : towards;
  const off = add(clicked, scale(into, -(depthM / 2 + RAISED_M)));
  const y = floorY === undefined ? clicked.y : floorY - 0.05;
  return { start: { rotation: facing(into), translation: { ...off, y } }, push: into };
}

export type Way = 'left' | 'right' | 'away' | 'nearer';

/** A way along the floor, as whoever looks sees it. */
export function wayInWorld({ worldFromCamera }: View, way: Way): Vec3 {
  const right = level(rotate(worldFromCamera.rotation, { x: 1, y: 0, z: 0 }));
  const away = cross(right, DOWN);
  const ways: Record<Way, Vec3> = { right, left: scale(right, -1), away, nearer: scale(away, -1) };
  return ways[way];
}

/** The way from one place to another along the floor; undefined: none to speak of. */
export function wayBetween(from: Vec3, to: Vec3): Vec3 | undefined {
  const way = { ...subtract(to, from), y: 0 };
  return norm(way) > 0.02 ? normalise(way) : undefined;
}

/** The turn whose axes these are: unit, right-handed. */
export function fromAxes(x: Vec3, y: Vec3, z: Vec3): Quaternion {
  const candidates: Quaternion[] = [
    { w: 1 + x.x + y.y + z.z, x: y.z - z.y, y: z.x - x.z, z: x.y - y.x },
    { w: y.z - z.y, x: 1 + x.x - y.y - z.z, y: x.y + y.x, z: z.x + x.z },
    { w: z.x - x.z, x: x.y + y.x, y: 1 - x.x + y.y - z.z, z: y.z + z.y },
    { w: x.y - y.x, x: z.x + x.z, y: y.z + z.y, z: 1 - x.x - y.y + z.z },
  ];
  const length = (q: Quaternion): number => Math.hypot(q.x, q.y, q.z, q.w);
  const best = candidates.reduce((a, b) => (length(b) > length(a) ? b : a));
  const l = length(best);
  return { x: best.x / l, y: best.y / l, z: best.z / l, w: best.w / l };
}

export interface Measured {
  readonly pose: Rigid3;
  readonly sizeM: Vec3;
}

const millimetres = (m: number): string => `${(1000 * m).toFixed(0)} mm`;

/**
 * The rectangle with one side from `a` to `b` whose other side goes through `c`, seen from `eye`. Why there is
 * none, in words.
 */
export function planeOf(a: Vec3, b: Vec3, c: Vec3, eye: Vec3): Measured | string {
  const along = subtract(b, a);
  const normal = cross(along, subtract(c, a));
  const widthM = norm(along);
  const depthM = widthM > 0 ? norm(normal) / widthM : 0;
  if (widthM < LEAST_SIDE_M || depthM < LEAST_SIDE_M) {
    const least = millimetres(Math.min(widthM, depthM));
    return `the three points lie within ${least} of a line; click them farther apart`;
  }
  const up = normalise(normal);
  const y = scale(up, dot(up, subtract(eye, a)) > 0 ? -1 : 1); // its own y axis is down
  const x = normalise(along);
  const z = cross(x, y);
  const far = dot(z, subtract(c, a));
  const translation = add(mix(a, b, 0.5), scale(z, far / 2));
  return {
    pose: { rotation: fromAxes(x, y, z), translation },
    sizeM: { x: widthM, y: 0, z: Math.abs(far) },
  };
}

/** The upright box between two opposite corners, turned as `rotation` is. Why there is none, in words. */
export function boxOf(a: Vec3, b: Vec3, rotation: Quaternion): Measured | string {
  const d = rotate(conjugate(rotation), subtract(b, a));
  const sizeM = { x: Math.abs(d.x), y: Math.abs(d.y), z: Math.abs(d.z) };
  const thin = (['x', 'y', 'z'] as const).find((axis) => sizeM[axis] < LEAST_SIDE_M);
  if (thin) {
    const side = { x: 'wide', y: 'high', z: 'deep' }[thin];
    return `the box would be ${millimetres(sizeM[thin])} ${side}; click two opposite corners, one low and one high`;
  }
  const translation = { ...mix(a, b, 0.5), y: Math.max(a.y, b.y) };
  return { pose: { rotation, translation }, sizeM };
}

/** Points of a room that were clicked. */
export interface RoomPoints {
  readonly floor: Vec3;
  readonly wall: readonly [Vec3, Vec3]; // of one wall
  readonly sides: readonly [Vec3, Vec3]; // one of each of the walls beside it
  readonly opposite: Vec3;
}

const LEAST_ROOM_M = 0.5;

/** The room whose floor and four walls go through these points. Why there is none, in words. */
export function roomOf(points: RoomPoints, heightM: number): Measured | string {
  const [a, b] = points.wall;
  const along = { ...subtract(b, a), y: 0 };
  if (norm(along) < 0.1) {
    return 'the two points of the wall lie above each other; click one farther to the side';
  }
  const line = normalise(along);
  const across = cross(line, DOWN);
  // Away from whoever stands in the room, before the wall.
  const sign = dot(across, subtract(points.opposite, a)) > 0 ? -1 : 1;
  const [x, z] = [scale(line, sign), scale(across, sign)];
  const sides = points.sides.map((point) => dot(x, point));
  const [low, high] = [Math.min(...sides), Math.max(...sides)];
  const [near, far] = [dot(z, points.opposite), (dot(z, a) + dot(z, b)) / 2];
  if (high - low < LEAST_ROOM_M || far - near < LEAST_ROOM_M) {
    const least = millimetres(Math.min(high - low, far - near));
    return `two opposite walls would be ${least} apart; click one point on each wall`;
  }
  const middle = add(scale(x, (low + high) / 2), scale(z, (near + far) / 2));
  return {
    pose: { rotation: facing(z), translation: { ...middle, y: points.floor.y } },
    sizeM: { x: high - low, y: heightM, z: far - near },
  };
}
