import type { SurfaceChunk } from '../gen/saccade/v1/surface_pb';
import type { Vec3 } from '../geometry/vec3';
import { toVec3 } from './convert';

/** Of meshoptimizer. */
export interface MeshDecoder {
  decodeVertexBuffer(target: Uint8Array, count: number, size: number, source: Uint8Array): void;
  decodeIndexBuffer(target: Uint8Array, count: number, size: number, source: Uint8Array): void;
}

/** A chunk as it is drawn and clicked: corner i is at origin + step * (places[4 i], [4 i + 1], [4 i + 2]). */
export interface SurfaceMesh {
  readonly originInWorld: Vec3;
  readonly stepM: number;
  readonly places: Uint16Array; // x, y, z, 0 of each corner
  readonly colours: Uint8Array; // red, green, blue, 255
  readonly normals: Int8Array; // x, y, z, 0; 127 is 1; towards where it was seen from
  readonly triangles: Uint16Array; // three corners each, counter-clockwise from there
  readonly low: Vec3; // of the box of its corners, in steps
  readonly high: Vec3;
}

const CORNER_BYTES = 12; // surface.proto
const MOST_CORNERS = 65_535;
const MOST_TRIANGLES = 262_144;

/** Throws, in words, where the chunk is not what surface.proto says. */
export function toMesh(decoder: MeshDecoder, chunk: SurfaceChunk): SurfaceMesh {
  const { cornerCount, triangleCount, stepM } = chunk;
  const originInWorld = toVec3(chunk.originInWorldM);
  if (cornerCount > MOST_CORNERS) throw new Error(`corner_count: ${cornerCount} is too many`);
  if (triangleCount > MOST_TRIANGLES) throw new Error(`triangle_count: ${triangleCount}`);
  const { x, y, z } = originInWorld;
  if (!(stepM > 0) || !Number.isFinite(stepM + x + y + z)) throw new Error('no finite place');
  const packed = new Uint8Array(CORNER_BYTES * cornerCount);
  decoder.decodeVertexBuffer(packed, cornerCount, CORNER_BYTES, chunk.corners);
  const triangles = new Uint16Array(3 * triangleCount);
  const bytes = new Uint8Array(triangles.buffer);
  decoder.decodeIndexBuffer(bytes, 3 * triangleCount, 2, chunk.triangles);
  for (const corner of triangles) {
    if (corner >= cornerCount) throw new Error(`triangles: there is no corner ${corner}`);
  }
  return { originInWorld, stepM, triangles, ...cornersOf(packed, cornerCount, triangles) };
}

type Corners = Pick<SurfaceMesh, 'places' | 'colours' | 'normals' | 'low' | 'high'>;

function cornersOf(packed: Uint8Array, count: number, triangles: Uint16Array): Corners {
  const data = new DataView(packed.buffer);
  const places = new Uint16Array(4 * count);
  const colours = new Uint8Array(4 * count);
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < count; ++i) {
    for (let axis = 0; axis < 3; ++axis) {
      const at = data.getUint16(CORNER_BYTES * i + 2 * axis, true);
      places[4 * i + axis] = at;
      colours[4 * i + axis] = packed[CORNER_BYTES * i + 6 + axis] ?? 0;
      if (at < (low[axis] ?? 0)) low[axis] = at;
      if (at > (high[axis] ?? 0)) high[axis] = at;
    }
    colours[4 * i + 3] = 255;
  }
  const box = (ends: number[]): Vec3 => ({ x: ends[0] ?? 0, y: ends[1] ?? 0, z: ends[2] ?? 0 });
  return { places, colours, normals: normalsOf(places, triangles), low: box(low), high: box(high) };
}

/** Of each corner, from the triangles round it, larger ones counting more. */
function normalsOf(places: Uint16Array, triangles: Uint16Array): Int8Array {
  const sums = new Float32Array(places.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 4 * (triangles[t] ?? 0);
    const b = 4 * (triangles[t + 1] ?? 0);
    const c = 4 * (triangles[t + 2] ?? 0);
    const [ax = 0, ay = 0, az = 0] = [places[a], places[a + 1], places[a + 2]];
    const [ux, uy, uz] = [at(places, b) - ax, at(places, b + 1) - ay, at(places, b + 2) - az];
    const [vx, vy, vz] = [at(places, c) - ax, at(places, c + 1) - ay, at(places, c + 2) - az];
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const corner of [a, b, c]) {
      sums[corner] = at(sums, corner) + nx;
      sums[corner + 1] = at(sums, corner + 1) + ny;
      sums[corner + 2] = at(sums, corner + 2) + nz;
    }
  }
  const normals = new Int8Array(places.length);
  for (let i = 0; i < sums.length; i += 4) {
    const [x, y, z] = [at(sums, i), at(sums, i + 1), at(sums, i + 2)];
    const scale = 127 / (Math.hypot(x, y, z) || 1);
    normals[i] = Math.round(x * scale);
    normals[i + 1] = Math.round(y * scale);
    normals[i + 2] = Math.round(z * scale);
  }
  return normals;
}

const at = (values: ArrayLike<number>, i: number): number => values[i] ?? 0;
