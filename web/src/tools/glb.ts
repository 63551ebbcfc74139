import type { Vec3 } from '../geometry/vec3';
import type { Part } from './overlay_models';

const [FLOAT, UINT] = [5126, 5125];

/** One of our points as glTF has it: y up, z to the viewer. */
const toGltf = ({ x, y, z }: Vec3): number[] => [x, -y, -z].map(Math.fround);

function chunk(type: number, data: Uint8Array, filler: number): Uint8Array {
  const padded = new Uint8Array(8 + 4 * Math.ceil(data.length / 4)).fill(filler);
  const header = new DataView(padded.buffer);
  header.setUint32(0, padded.length - 8, true);
  header.setUint32(4, type, true);
  padded.set(data, 8);
  return padded;
}

function joined(pieces: readonly Uint8Array[]): Uint8Array {
  const all = new Uint8Array(pieces.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const piece of pieces) {
    all.set(piece, at);
    at += piece.length;
  }
  return all;
}

/** A GLB file (glTF 2.0) of triangles in our frame: one mesh, a material for each part. */
export function glbOf(parts: readonly Part[]): Uint8Array {
  const pieces: Uint8Array[] = [];
  const views: object[] = [];
  const accessors: object[] = [];
  const add = (data: Uint8Array, accessor: object): number => {
    const byteOffset = pieces.reduce((sum, { length }) => sum + length, 0);
    views.push({ buffer: 0, byteOffset, byteLength: data.length });
    pieces.push(data);
    return accessors.push({ bufferView: views.length - 1, ...accessor }) - 1;
  };
  const primitives = parts.map(({ corners }, material) => {
    const points = corners.map(toGltf);
    const count = points.length;
    const range = (pick: (...values: number[]) => number): number[] =>
      [0, 1, 2].map((axis) => points.reduce((best, p) => pick(best, p[axis] ?? 0), pick()));
    const floats = new Uint8Array(new Float32Array(points.flat()).buffer);
    const indices = new Uint8Array(Uint32Array.from({ length: count }, (_, i) => i).buffer);
    const position = { componentType: FLOAT, count, type: 'VEC3' };
    return {
      attributes: {
        POSITION: add(floats, { ...position, min: range(Math.min), max: range(Math.max) }),
      },
      indices: add(indices, { componentType: UINT, count, type: 'SCALAR' }),
      material,
    };
  });
  const binary = joined(pieces);
  const root = {
    ...{ asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }] },
    meshes: [{ primitives }],
    materials: parts.map(({ colour }) => ({
      pbrMetallicRoughness: { baseColorFactor: [...colour, 1], metallicFactor: 0 },
    })),
    ...{ accessors, bufferViews: views, buffers: [{ byteLength: binary.length }] },
  };
  const json = chunk(0x4e4f534a, new TextEncoder().encode(JSON.stringify(root)), 0x20);
  const body = joined([json, chunk(0x004e4942, binary, 0)]);
  const head = new Uint8Array(12);
  const header = new DataView(head.buffer);
  header.setUint32(0, 0x46546c67, true);
  header.setUint32(4, 2, true);
  header.setUint32(8, head.length + body.length, true);
  return joined([head, body]);
}
