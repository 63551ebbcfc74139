import { rotate } from '../geometry/rigid3';
import { add, cross, norm, normalise, scale, subtract, type Vec3 } from '../geometry/vec3';
import { eyeOf, type View } from '../geometry/view';
import type { Mark } from './strokes';

/*
 * The lines of each shape in world, y down, as docs/design/marks.md and overlay.md have them: the server's
 * `strokes.cpp` draws the same.
 */

const Y: Vec3 = { x: 0, y: 1, z: 0 };
const NOTHING_M = 1e-6;

const vec = (x: number, y: number, z: number): Vec3 => ({ x, y, z });

/** A point of the mark's own axes, from its anchor. */
const inWorld = (mark: Mark, v: Vec3): Vec3 =>
  add(mark.pointInWorld, mark.worldFromMark ? rotate(mark.worldFromMark, v) : v);

/** 12 edges, the anchor in the middle. */
function boxEdges(mark: Mark, edge: Vec3): Vec3[][] {
  const corner = (i: number): Vec3 =>
    inWorld(
      mark,
      vec(
        i & 1 ? edge.x / 2 : -edge.x / 2,
        i & 2 ? edge.y / 2 : -edge.y / 2,
        i & 4 ? edge.z / 2 : -edge.z / 2,
      ),
    );
  const edges: Vec3[][] = [];
  for (let i = 0; i < 8; ++i) {
    for (const bit of [1, 2, 4]) {
      if (!(i & bit)) edges.push([corner(i), corner(i | bit)]);
    }
  }
  return edges;
}

/** Its tip is the anchor; it points along its own +y (down where gravity is known and nothing turns it). */
function arrowLines(mark: Mark): Vec3[][] {
  const tip = mark.pointInWorld;
  const up = (dx: number, dy: number, dz: number): Vec3 => inWorld(mark, vec(dx, -dy, dz));
  const head = mark.sizeM * 0.4;
  const half = head * 0.5;
  return [
    [arrowTail(mark), tip],
    [up(-half, head, 0), tip, up(half, head, 0)],
    [up(0, head, -half), tip, up(0, head, half)],
  ];
}

/** The end of an arrow that is not its tip. */
export const arrowTail = (mark: Mark): Vec3 => inWorld(mark, vec(0, -2 * mark.sizeM, 0));

/** The other end of a measure. */
export const measureEnd = ({ pointInWorld, inkOffsetsM }: Mark): Vec3 =>
  add(pointInWorld, inkOffsetsM[0] ?? vec(0, 0, 0));

function measureLines(mark: Mark): Vec3[][] {
  const from = mark.pointInWorld;
  const to = measureEnd(mark);
  const along = subtract(to, from);
  const length = norm(along);
  if (length < NOTHING_M) return [[from, to]];
  const level = cross(along, Y);
  const across = normalise(norm(level) < 0.1 * length ? cross(along, vec(1, 0, 0)) : level);
  const half = scale(across, Math.min(0.2 * mark.sizeM, 0.25 * length));
  const tick = (end: Vec3): Vec3[] => [subtract(end, half), add(end, half)];
  return [[from, to], tick(from), tick(to)];
}

function pinLines({ pointInWorld: p, sizeM: s }: Mark): Vec3[][] {
  const kite = (across: (d: number) => Vec3): Vec3[] => [
    p,
    add(p, across(-0.25 * s)),
    add(p, vec(0, -s, 0)),
    add(p, across(0.25 * s)),
    p,
  ];
  return [kite((d) => vec(d, -0.7 * s, 0)), kite((d) => vec(0, -0.7 * s, d))];
}

/** To the right of a picture, as whoever looks sees it. */
function rightOf(mark: Mark, view: View): Vec3 {
  const away = subtract(mark.pointInWorld, eyeOf(view));
  const level = vec(away.x, 0, away.z);
  if (norm(level) >= NOTHING_M) return cross(Y, normalise(level));
  const x = rotate(view.worldFromCamera.rotation, vec(1, 0, 0));
  return normalise(vec(x.x, 0, x.z));
}

/** A picture's outline from its lower left corner, closed. */
export function pictureOutline(mark: Mark, view: View): Vec3[] {
  const p = mark.pointInWorld;
  const right = scale(rightOf(mark, view), mark.sizeM / 2);
  const up = vec(0, -mark.sizeM * mark.aspect, 0);
  const [left, far] = [subtract(p, right), add(p, right)];
  return [left, far, add(far, up), add(left, up), left];
}

export function linesOf(mark: Mark, view: View): readonly (readonly Vec3[])[] {
  const { pointInWorld: p, sizeM: s } = mark;
  switch (mark.shape) {
    case 'cube':
      return boxEdges({ ...mark, worldFromMark: undefined }, vec(s, s, s));
    case 'box':
      return boxEdges(mark, mark.extentM ?? vec(s, s, s));
    case 'note':
    case 'check_list':
      return [[p, labelPoint(mark)]];
    case 'arrow':
      return arrowLines(mark);
    case 'ink':
      return [mark.inkOffsetsM.map((offset) => add(p, offset))];
    case 'measure':
      return measureLines(mark);
    case 'pin':
      return pinLines(mark);
    case 'picture':
      return [pictureOutline(mark, view)];
  }
}

/** Where its label stands. */
export function labelPoint(mark: Mark): Vec3 {
  const { pointInWorld: p, sizeM: s } = mark;
  switch (mark.shape) {
    case 'note':
    case 'check_list':
    case 'pin':
      return add(p, vec(0, -s, 0));
    case 'picture':
      return add(p, vec(0, -s * mark.aspect, 0));
    case 'measure':
      return add(p, scale(mark.inkOffsetsM[0] ?? vec(0, 0, 0), 0.5));
    default:
      return p;
  }
}

/** No line of it is farther from its anchor [m]. */
export function reachOf({ shape, sizeM, extentM, inkOffsetsM, aspect }: Mark): number {
  switch (shape) {
    case 'box':
      return extentM ? norm(extentM) : 2 * sizeM;
    case 'ink':
    case 'measure':
      return sizeM + Math.max(0, ...inkOffsetsM.map(norm));
    case 'picture':
      return sizeM * (1 + aspect);
    default:
      return 2.5 * sizeM;
  }
}
