import type { Vec3 } from '../geometry/vec3';
import type { Material } from '../session/scene_book';

/** As shared/render/contact_shadow.cpp, whose picture the server's view has. */
const FOOT_M = 0.03; // what is no higher is the foot
const ABOVE_M = 0.002; // over what it falls on; below OCCLUSION_BIAS_M
const REACH_M = 0.02; // a support is no farther below
const [LEAST_SOFT_M, MOST_SOFT_M, SOFT_SHARE] = [0.03, 0.12, 0.2];
const DARKEST = 0.5;
const RINGS = 5; // of the soft rim
const ROUND = 8; // points round each corner
const MOST_THINGS = 64;

/** A mesh where it is: three corners a triangle, in our world [m]. */
export interface PlacedMesh {
  readonly material: Material;
  readonly corners: readonly Vec3[];
}

/** Soft dark patches where virtual things rest on something, in our world. */
export interface ShadowMesh {
  readonly positions: Vec3[]; // [m]
  readonly darkness: number[]; // of each, 0 to 1
  readonly triangles: (readonly [number, number, number])[];
}

/** A place of the floor plan: x and z of the world. */
type Plan = readonly [number, number];
type Triangle = readonly [Vec3, Vec3, Vec3];

/** Height (y) of a triangle over a place of the plan; undefined where it is not. */
function heightAt([a, b, c]: Triangle, [x, z]: Plan): number | undefined {
  const [bx, bz, cx, cz] = [b.x - a.x, b.z - a.z, c.x - a.x, c.z - a.z];
  const area = bx * cz - bz * cx;
  if (Math.abs(area) < 1e-12) return undefined;
  const u = ((x - a.x) * cz - (z - a.z) * cx) / area;
  const v = (bx * (z - a.z) - bz * (x - a.x)) / area;
  if (Math.min(u, v) < -1e-6 || u + v > 1 + 1e-6) return undefined;
  return a.y + u * (b.y - a.y) + v * (c.y - a.y);
}

/** Convex outline, in order (Andrew's monotone chain). */
export function outlineOf(points: readonly Plan[]): Plan[] {
  const sorted = [...points].sort((a, b) => (a[0] === b[0] ? a[1] - b[1] : a[0] - b[0]));
  const left = (a: Plan, b: Plan, c: Plan): boolean =>
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 1e-12;
  const half = (run: readonly Plan[]): Plan[] => {
    const hull: Plan[] = [];
    for (const p of run) {
      for (let [a, b] = hull.slice(-2); a && b && !left(a, b, p); [a, b] = hull.slice(-2))
        hull.pop();
      hull.push(p);
    }
    hull.pop();
    return hull;
  };
  return [...half(sorted), ...half([...sorted].reverse())];
}

/** Points `away` outside the outline, rounded at its corners; as many for every distance. */
function around(outline: readonly Plan[], away: number): Plan[] {
  const n = outline.length;
  return outline.flatMap((corner, k) => {
    const [before, after] = [outline.at(k - 1), outline[(k + 1) % n]];
    if (!before || !after) return [];
    // Counter-clockwise outlines have their outside at the right.
    const from = Math.atan2(before[0] - corner[0], corner[1] - before[1]);
    let turn = Math.atan2(corner[0] - after[0], after[1] - corner[1]) - from;
    while (turn < 0) turn += 2 * Math.PI;
    return Array.from({ length: ROUND + 1 }, (_, i): Plan => {
      const angle = from + (turn * i) / ROUND;
      return [corner[0] + away * Math.cos(angle), corner[1] + away * Math.sin(angle)];
    });
  });
}

function trianglesOf(corners: readonly Vec3[]): Triangle[] {
  const triangles: Triangle[] = [];
  for (let i = 0; i < corners.length; i += 3) {
    const [a, b, c] = corners.slice(i, i + 3);
    if (a && b && c) triangles.push([a, b, c]);
  }
  return triangles;
}

/** Triangles of what stands still about as high as a foot. */
function supportsOf(meshes: readonly PlacedMesh[], thing: PlacedMesh, footY: number): Triangle[] {
  const solid = meshes.filter(
    (mesh) => mesh !== thing && (mesh.material === 'real' || mesh.material === 'virtual'),
  );
  return solid
    .flatMap(({ corners }) => trianglesOf(corners))
    .filter((t) => {
      const heights = t.map(({ y }) => y);
      return Math.max(...heights) >= footY - REACH_M && Math.min(...heights) <= footY + REACH_M;
    });
}

function addShadow(meshes: readonly PlacedMesh[], thing: PlacedMesh, shadows: ShadowMesh): void {
  const footY = thing.corners.reduce((most, { y }) => Math.max(most, y), -Infinity);
  const foot = thing.corners.filter(({ y }) => y >= footY - FOOT_M).map(({ x, z }): Plan => [x, z]);
  const outline = outlineOf(foot);
  if (outline.length < 3) return;
  const supports = supportsOf(meshes, thing, footY);
  const isUnder = (at: Plan): boolean =>
    supports.some((t) => Math.abs((heightAt(t, at) ?? Infinity) - footY) <= REACH_M);
  const spread = (axis: 0 | 1): number => {
    const values = foot.map((p) => p[axis]);
    return values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b));
  };
  const softM = Math.min(
    Math.max(SOFT_SHARE * Math.min(spread(0), spread(1)), LEAST_SOFT_M),
    MOST_SOFT_M,
  );
  const add = (at: Plan, darkness: number): number => {
    shadows.positions.push({ x: at[0], y: footY - ABOVE_M, z: at[1] });
    shadows.darkness.push(isUnder(at) ? darkness : 0);
    return shadows.positions.length - 1;
  };
  const mean = (axis: 0 | 1): number =>
    outline.reduce((sum, p) => sum + p[axis], 0) / outline.length;
  const centre = add([mean(0), mean(1)], DARKEST);
  let last = 0;
  for (let ring = 0; ring <= RINGS; ++ring) {
    const share = ring / RINGS;
    const indices = around(outline, share * softM).map((at) => add(at, DARKEST * (1 - share) ** 2));
    const [first = 0] = indices;
    const count = indices.length;
    for (let k = 0; k < count; ++k) {
      const next = (k + 1) % count;
      if (ring === 0) {
        shadows.triangles.push([centre, first + k, first + next]);
      } else {
        shadows.triangles.push([last + k, first + k, first + next]);
        shadows.triangles.push([last + k, first + next, last + next]);
      }
    }
    last = first;
  }
}

/**
 * Of every virtual mesh that stands on a real or virtual one: dark under its foot, gone some centimetres beside
 * it, and only where there is something to fall on.
 */
export function contactShadows(meshes: readonly PlacedMesh[]): ShadowMesh {
  const shadows: ShadowMesh = { positions: [], darkness: [], triangles: [] };
  const things = meshes.filter(
    ({ material, corners }) => material === 'virtual' && corners.length > 0,
  );
  for (const thing of things.slice(0, MOST_THINGS)) addShadow(meshes, thing, shadows);
  return shadows;
}
