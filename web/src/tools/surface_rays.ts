import { dot, normalise, scale, subtract, type Vec3 } from '../geometry/vec3';
import type { SurfaceMesh } from '../session/surface_mesh';
import type { Ray } from './thing_rays';

/** Where a line of sight meets the place's surfaces. */
export interface SurfaceHit {
  readonly pointInWorld: Vec3;
  readonly normalInWorld: Vec3; // unit, towards where the ray comes from
  readonly rangeM: number;
  readonly sigmaM: number; // along the ray, as the server claims it
}

const SIGMA_SHARE = 0.01; // of the range: server/anchors/surface_look.cpp
const SIGMA_VOXELS = 0.5;
const SHALLOW = 0.15; // cosine
const VOXEL_STEPS = 1760; // server/surface/surface_nets.cpp

const AXES = ['x', 'y', 'z'] as const;

interface Passed {
  readonly mesh: SurfaceMesh;
  readonly origin: Vec3; // of the ray, in steps from the chunk's
  readonly enters: number;
}

/** Where the ray enters the mesh's box, in lengths of `d`; undefined: it passes by. */
function enters({ low, high }: SurfaceMesh, o: Vec3, d: Vec3): number | undefined {
  let [near, far] = [0, Infinity];
  for (const axis of AXES) {
    const inverse = 1 / (Math.abs(d[axis]) > 1e-12 ? d[axis] : 1e-12);
    const a = (low[axis] - o[axis]) * inverse;
    const b = (high[axis] - o[axis]) * inverse;
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? near : undefined;
}

interface MeshHit {
  readonly along: number; // in lengths of the direction
  readonly normal: Vec3; // smooth, from the corners'
}

/** The nearest triangle, from either side (Moeller and Trumbore 1997), nearer than `nearest`. */
function meet(mesh: SurfaceMesh, o: Vec3, d: Vec3, nearest: number): MeshHit | undefined {
  const { places, triangles } = mesh;
  const at = (i: number): number => places[i] ?? 0;
  let best: { t: number; u: number; v: number } | undefined;
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 4 * (triangles[t] ?? 0);
    const b = 4 * (triangles[t + 1] ?? 0);
    const c = 4 * (triangles[t + 2] ?? 0);
    const [ax, ay, az] = [at(a), at(a + 1), at(a + 2)];
    const [ux, uy, uz] = [at(b) - ax, at(b + 1) - ay, at(b + 2) - az];
    const [vx, vy, vz] = [at(c) - ax, at(c + 1) - ay, at(c + 2) - az];
    const [px, py, pz] = [d.y * vz - d.z * vy, d.z * vx - d.x * vz, d.x * vy - d.y * vx];
    const determinant = ux * px + uy * py + uz * pz;
    if (determinant === 0) continue;
    const [sx, sy, sz] = [o.x - ax, o.y - ay, o.z - az];
    const u = (sx * px + sy * py + sz * pz) / determinant;
    if (u < 0 || u > 1) continue;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    const v = (d.x * qx + d.y * qy + d.z * qz) / determinant;
    if (v < 0 || u + v > 1) continue;
    const along = (vx * qx + vy * qy + vz * qz) / determinant;
    if (along <= 0 || along >= nearest) continue;
    nearest = along;
    best = { t, u, v };
  }
  return best && { along: nearest, normal: normalAt(mesh, best.t, best.u, best.v) };
}

function normalAt({ normals, triangles }: SurfaceMesh, t: number, u: number, v: number): Vec3 {
  const sum = { x: 0, y: 0, z: 0 };
  for (const [k, weight] of [1 - u - v, u, v].entries()) {
    const corner = 4 * (triangles[t + k] ?? 0);
    AXES.forEach((axis, i) => (sum[axis] += weight * (normals[corner + i] ?? 0)));
  }
  return normalise(sum);
}

/** The nearest surface on the ray, from either side; undefined: a hole. */
export function hitSurfaces(meshes: Iterable<SurfaceMesh>, ray: Ray): SurfaceHit | undefined {
  const direction = normalise(ray.directionInWorld);
  const passed: Passed[] = [];
  for (const mesh of meshes) {
    const origin = scale(subtract(ray.originInWorld, mesh.originInWorld), 1 / mesh.stepM);
    const along = enters(mesh, origin, direction);
    if (along !== undefined) passed.push({ mesh, origin, enters: along * mesh.stepM });
  }
  passed.sort((a, b) => a.enters - b.enters);
  let best: { mesh: SurfaceMesh; rangeM: number; normal: Vec3 } | undefined;
  for (const { mesh, origin, enters: first } of passed) {
    if (best && first > best.rangeM) break;
    const most = best ? best.rangeM / mesh.stepM : Infinity;
    const hit = meet(mesh, origin, direction, most);
    if (hit) best = { mesh, rangeM: hit.along * mesh.stepM, normal: hit.normal };
  }
  if (!best) return undefined;
  const { mesh, rangeM, normal } = best;
  const facing = -dot(normal, direction);
  const voxelM = mesh.stepM * VOXEL_STEPS;
  const slant = Math.max(Math.abs(facing), SHALLOW);
  return {
    pointInWorld: {
      x: ray.originInWorld.x + rangeM * direction.x,
      y: ray.originInWorld.y + rangeM * direction.y,
      z: ray.originInWorld.z + rangeM * direction.z,
    },
    normalInWorld: facing < 0 ? scale(normal, -1) : normal,
    rangeM,
    sigmaM: Math.hypot(SIGMA_SHARE * rangeM, (SIGMA_VOXELS * voxelM) / slant),
  };
}
