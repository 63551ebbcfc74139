import { create } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';
import { beforeAll, describe, expect, test } from 'vitest';
import {
  GetSurfaceResponseSchema,
  type SurfaceChunk,
  SurfaceChunkSchema,
  SurfaceEventSchema,
} from '../../src/gen/saccade/v1/surface_pb';
import { Camera } from '../../src/geometry/camera';
import { IDENTITY } from '../../src/geometry/rigid3';
import { distance } from '../../src/geometry/vec3';
import { makeView, rayOf } from '../../src/geometry/view';
import { Viewpoint } from '../../src/scene/viewpoint';
import { nameOf, SurfaceBook, type SurfaceCalls } from '../../src/session/surface_book';
import { type SurfaceMesh, toMesh } from '../../src/session/surface_mesh';
import type { Feature } from '../../src/session/types';
import { landingInMap, lyingRing } from '../../src/tools/landing';
import { hitSurfaces } from '../../src/tools/surface_rays';

beforeAll(() => Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]));

const SIDE = 33;
const STEP_M = 0.00005;

interface Corner {
  readonly place: readonly [number, number, number];
  readonly colour: readonly [number, number, number];
}

/** As the server packs them. */
function pack(corners: readonly Corner[], triangles: readonly number[]) {
  const bytes = new Uint8Array(12 * corners.length);
  const data = new DataView(bytes.buffer);
  corners.forEach(({ place, colour }, i) => {
    place.forEach((value, axis) => data.setUint16(12 * i + 2 * axis, value, true));
    bytes.set(colour, 12 * i + 6);
  });
  const indices = new Uint8Array(Uint16Array.from(triangles).buffer);
  return {
    cornerCount: corners.length,
    triangleCount: triangles.length / 3,
    corners: MeshoptEncoder.encodeVertexBuffer(bytes, corners.length, 12),
    triangles: MeshoptEncoder.encodeIndexBuffer(indices, triangles.length, 2),
  };
}

/** A square that faces whoever looks along +z from before it: in steps SIDE - 1 thousands wide, at z = 10 times `depth`. */
function square(depth: number, x = 0): SurfaceChunk {
  const corners: Corner[] = [];
  const triangles: number[] = [];
  for (let row = 0; row < SIDE; ++row) {
    for (let column = 0; column < SIDE; ++column) {
      corners.push({ place: [1000 * column, 1000 * row, 10 * depth], colour: [column, row, 200] });
      if (row === 0 || column === 0) continue;
      const d = row * SIDE + column;
      const [a, b, c] = [d - SIDE - 1, d - SIDE, d - 1];
      triangles.push(a, c, b, b, c, d); // counter-clockwise from the side of -z, y down
    }
  }
  const place = { originInWorldM: { x: x - 0.8, y: -0.8, z: 1 }, stepM: STEP_M };
  return create(SurfaceChunkSchema, { x, y: 0, z: 0, ...place, ...pack(corners, triangles) });
}

describe('a chunk', () => {
  test('is unpacked as it was packed, with normals towards where it was seen from', () => {
    const mesh = toMesh(MeshoptDecoder, square(400));
    expect(mesh.places.length).toBe(4 * SIDE * SIDE);
    const seen = new Set<string>();
    for (let i = 0; i < SIDE * SIDE; ++i) {
      const [x = 0, y = 0, z] = mesh.places.subarray(4 * i);
      expect(z).toBe(4000);
      expect([...mesh.colours.subarray(4 * i, 4 * i + 3)]).toEqual([x / 1000, y / 1000, 200]);
      expect([...mesh.normals.subarray(4 * i, 4 * i + 3)]).toEqual([0, 0, -127]);
      seen.add(`${x} ${y}`);
    }
    expect(seen.size).toBe(SIDE * SIDE);
    expect(mesh.triangles.length).toBe(6 * (SIDE - 1) ** 2);
    expect([mesh.low, mesh.high]).toEqual([
      { x: 0, y: 0, z: 4000 },
      { x: 32_000, y: 32_000, z: 4000 },
    ]);
  });

  test('that is damaged throws, wherever it is', () => {
    const good = square(400);
    const withs: Partial<SurfaceChunk>[] = [
      { corners: good.corners.subarray(0, 40) },
      { corners: new Uint8Array() },
      { triangles: good.triangles.subarray(0, 20) },
      { triangles: Uint8Array.from(good.triangles, (byte, i) => (i === 0 ? 0x13 : byte)) },
      { cornerCount: SIDE },
      { cornerCount: 1 << 24 },
      { triangleCount: 1 << 28 },
      { stepM: NaN },
      { stepM: 0 },
    ];
    for (const part of withs) {
      expect(() => toMesh(MeshoptDecoder, { ...good, ...part }), Object.keys(part)[0]).toThrow();
    }
    // What came before does no harm to what comes after.
    expect(toMesh(MeshoptDecoder, good).places.length).toBe(4 * SIDE * SIDE);
  });

  test('of whatever bytes throws or is a mesh: nothing else', () => {
    const good = square(7);
    let meshes = 0;
    for (let round = 0; round < 300; ++round) {
      const spoil = (bytes: Uint8Array): Uint8Array<ArrayBuffer> => {
        const spoilt = new Uint8Array(bytes);
        const at = (round * 7919) % spoilt.length;
        spoilt[at] = (spoilt[at] ?? 0) ^ (1 << round % 8);
        return spoilt;
      };
      const chunk =
        round % 2 === 0
          ? { ...good, corners: spoil(good.corners) }
          : { ...good, triangles: spoil(good.triangles) };
      try {
        const mesh = toMesh(MeshoptDecoder, chunk);
        expect(Math.max(...mesh.triangles)).toBeLessThan(SIDE * SIDE);
        ++meshes;
      } catch (error) {
        expect(error).toBeInstanceOf(Error);
      }
    }
    expect(meshes).toBeLessThan(300);
  });
});

/** A server's end: answers by hand, time as the test has it. */
class Server {
  nowMs = 0;
  readonly asked: { edition: bigint; version: bigint; maxBytes: number; atMs: number }[] = [];
  answers: (() => Partial<Parameters<typeof makeAnswer>[0]>)[] = [];
  readonly rests: number[] = [];
  tookMs = 80;
  readonly end = new AbortController();
  readonly clock = {
    nowMs: () => this.nowMs,
    sleep: (ms: number) => {
      this.rests.push(ms);
      this.nowMs += ms;
      return Promise.resolve();
    },
  };
  readonly calls: SurfaceCalls = {
    get: async ({ edition, version, maxBytes }) => {
      this.asked.push({ edition, version, maxBytes, atMs: this.nowMs });
      await Promise.resolve();
      this.nowMs += this.tookMs;
      const answer = this.answers.shift();
      if (!answer) throw new Error('nobody was to ask');
      return makeAnswer(answer());
    },
  };
}

const makeAnswer = (part: {
  edition?: bigint;
  version?: bigint;
  chunks?: SurfaceChunk[];
  more?: boolean;
}) => create(GetSurfaceResponseSchema, part);

const event = (edition: bigint, version: bigint) =>
  create(SurfaceEventSchema, { edition, version });
const settled = () => new Promise((resolve) => setTimeout(resolve, 5));

function changes(book: SurfaceBook): string[] {
  const names: string[] = [];
  for (let next = book.takeChanged(); next; next = book.takeChanged()) {
    names.push(`${next.name}${next.chunk ? '' : ' gone'}`);
  }
  return names;
}

describe('the book', () => {
  const gone = (x: number) => create(SurfaceChunkSchema, { x });

  test('asks step by step for what is new, rests in between, and not for nobody', async () => {
    const server = new Server();
    const book = new SurfaceBook(server.clock);
    void book.follow(server.calls, 'me', server.end.signal);
    book.apply(event(5n, 9n));
    await settled();
    expect(server.asked).toEqual([]);
    server.answers = [
      () => ({ edition: 5n, version: 4n, chunks: [square(1, 0), square(1, 1)], more: true }),
      () => ({ edition: 5n, version: 9n, chunks: [square(2, 1)] }),
    ];
    book.want(true);
    await settled();
    expect(server.asked.map(({ edition, version }) => [edition, version])).toEqual([
      [0n, 0n],
      [5n, 4n],
    ]);
    expect(server.rests.every((ms) => ms >= server.tookMs)).toBe(true);
    expect(book.state).toBe('some');
    expect(changes(book)).toEqual(['0 0 0', '1 0 0']);
    expect(book.chunks.get(nameOf({ x: 1, y: 0, z: 0 }))?.cornerCount).toBe(SIDE * SIDE);
    book.apply(event(5n, 9n)); // nothing new
    await settled();
    expect(server.asked.length).toBe(2);
    server.answers = [() => ({ edition: 5n, version: 11n, chunks: [gone(0)] })];
    book.apply(event(5n, 11n));
    await settled();
    expect(changes(book)).toEqual(['0 0 0 gone']);
    expect([...book.chunks.keys()]).toEqual(['1 0 0']);
    server.end.abort();
  });

  test('forgets all with another edition, and with a server that was started again', async () => {
    const server = new Server();
    const book = new SurfaceBook(server.clock);
    book.want(true);
    server.answers = [() => ({ edition: 5n, version: 9n, chunks: [square(1, 0), square(1, 1)] })];
    void book.follow(server.calls, 'me', server.end.signal);
    await settled();
    changes(book);
    server.answers = [() => ({ edition: 6n, version: 1n, chunks: [square(1, 1)] })];
    book.apply(event(6n, 1n));
    await settled();
    expect(changes(book).sort()).toEqual(['0 0 0 gone', '1 0 0']);
    server.answers = [() => ({ edition: 6n, version: 0n })];
    book.apply(event(6n, 0n)); // less than there was
    await settled();
    expect(server.asked.at(-1)).toMatchObject({ edition: 0n, version: 0n });
    expect(changes(book)).toEqual(['1 0 0 gone']);
    expect(book.state).toBe('none yet');
    // Over a new connection it goes on from what it has.
    server.end.abort();
    await settled();
    const again = new AbortController();
    server.answers = [() => ({ edition: 8n, version: 3n, chunks: [square(1, 2)] })];
    void book.follow(server.calls, 'me', again.signal);
    await settled();
    expect(changes(book)).toEqual(['2 0 0']);
    again.abort();
  });

  test('a slow link gets small answers, an overloaded server is left alone for longer and longer', async () => {
    const server = new Server();
    const book = new SurfaceBook(server.clock);
    book.want(true);
    server.tookMs = 2000;
    const refuse = () => {
      throw new ConnectError('too many', Code.ResourceExhausted);
    };
    server.answers = [
      () => ({ edition: 5n, version: 1n, chunks: [square(1)], more: true }),
      () => ({ edition: 5n, version: 2n, chunks: [square(2)], more: true }),
      refuse,
      refuse,
      refuse,
      () => ({ edition: 5n, version: 3n }),
    ];
    void book.follow(server.calls, 'me', server.end.signal);
    await settled();
    const bytes = server.asked.map(({ maxBytes }) => maxBytes);
    expect(bytes[1]).toBe(8192);
    expect(Math.max(...bytes.slice(1))).toBe(8192);
    const [first = 0, second = 0, third = 0] = server.rests.slice(2, 5);
    expect(second).toBeGreaterThan(first);
    expect(third).toBeGreaterThan(second);
    expect(server.asked.length).toBe(6);
    server.end.abort();
  });

  test('a server without surfaces is asked once', async () => {
    for (const answer of [
      () => ({ edition: 0n }),
      () => {
        throw new ConnectError('what', Code.Unimplemented);
      },
    ]) {
      const server = new Server();
      const book = new SurfaceBook(server.clock);
      book.want(true);
      server.answers = [answer];
      void book.follow(server.calls, 'me', server.end.signal);
      await settled();
      expect(book.state).toBe('not made');
      expect(server.asked.length).toBe(1);
      server.end.abort();
    }
  });
});

const CAMERA = new Camera({
  ...{ model: 'pinhole', width: 640, height: 480, fx: 500, fy: 500, cx: 319.5, cy: 239.5 },
  distortion: [],
});

describe('a line of sight', () => {
  const view = makeView(CAMERA, IDENTITY);
  let meshes: SurfaceMesh[] = [];
  beforeAll(() => {
    meshes = [toMesh(MeshoptDecoder, square(2000)), toMesh(MeshoptDecoder, square(400))];
  });
  const rayAt = (u: number, v: number) => ({
    originInWorld: { x: 0, y: 0, z: 0 },
    directionInWorld: rayOf(view, { u, v }) ?? { x: 0, y: 0, z: 1 },
  });

  test('meets the nearest surface, from either side, with its normal; or nothing', () => {
    const hit = hitSurfaces(meshes, rayAt(419.5, 239.5))!;
    expect(distance(hit.pointInWorld, { x: 0.24, y: 0, z: 1.2 })).toBeLessThan(1e-6);
    expect(hit.normalInWorld.z).toBeCloseTo(-1, 6);
    expect(hit.rangeM).toBeCloseTo(Math.hypot(0.24, 1.2), 6);
    expect(hit.sigmaM).toBeGreaterThan(0.01 * hit.rangeM);
    const back = hitSurfaces(meshes, {
      originInWorld: { x: 0, y: 0, z: 4 },
      directionInWorld: { x: 0, y: 0, z: -3 },
    })!;
    expect(back.pointInWorld.z).toBeCloseTo(2, 6);
    expect(back.normalInWorld.z).toBeCloseTo(1, 6);
    expect(back.rangeM).toBeCloseTo(2, 6);
    expect(hitSurfaces(meshes, rayAt(0, 0))).toBeDefined();
    expect(
      hitSurfaces(meshes, {
        originInWorld: { x: 0, y: 0, z: 0 },
        directionInWorld: { x: 1, y: 0, z: 0.1 },
      }),
    ).toBeUndefined();
  });

  const feature = (z: number): Feature => ({
    ...{ id: 7, state: 'measured', pointInWorld: { x: 0, y: 0, z } },
    ...{ covariance: [1e-6, 0, 0, 1e-6, 0, 1e-6], depthKnown: true },
    ...{ pixel: undefined, matchedCount: 9 },
  });

  test('a click means the surface, but for a feature on it that is clicked itself', () => {
    const middle = { u: 319.5, v: 239.5 };
    const surface = hitSurfaces(meshes, rayAt(middle.u, middle.v));
    const alone = landingInMap(view, middle, { features: [], surface })!;
    expect(alone.how).toBe('surface');
    expect(alone.target.kind).toBe('ray');
    expect(alone.depthM).toBeCloseTo(1.2, 6);
    const on = landingInMap(view, middle, { features: [feature(1.201)], surface })!;
    expect(on.target).toEqual({ kind: 'feature', featureId: 7 });
    expect(on.sigmaM).toBeCloseTo(0.001, 6);
    // One behind the surface is not what was clicked, nor one beside the click.
    const behind = landingInMap(view, middle, { features: [feature(2)], surface })!;
    expect(behind.how).toBe('surface');
    const beside = { u: 340, v: 239.5 };
    const hit = hitSurfaces(meshes, rayAt(beside.u, beside.v));
    const landed = landingInMap(view, beside, { features: [feature(1.2)], surface: hit })!;
    expect(landed.target.kind).toBe('ray');
  });

  test('its ring lies in the surface', () => {
    const surface = hitSurfaces(meshes, rayAt(319.5, 239.5));
    const landing = landingInMap(view, { u: 319.5, v: 239.5 }, { features: [], surface })!;
    const ring = lyingRing(landing, 2)!;
    for (const point of ring.rim) {
      expect(point.z).toBeCloseTo(1.2, 5);
      expect(distance(point, landing.pointInWorld)).toBeCloseTo(2 * landing.sigmaM!, 6);
    }
    expect(ring.pin[1].z).toBeLessThan(1.2);
  });
});

describe('the eye in the map', () => {
  const wearer = {
    camera: CAMERA,
    worldFromCamera: { rotation: IDENTITY.rotation, translation: { x: 1, y: -1.5, z: 0 } },
  };
  const bounds = { centre: { x: 0, y: 0, z: 2 }, radius: 2 };
  const settle = (eye: Viewpoint) => {
    for (let i = 0; i < 40; ++i) eye.step(16, wearer);
  };

  test('stands where the wearer stands, and walks on from there by hand', () => {
    const eye = new Viewpoint();
    expect(eye.choose('wearer', undefined, bounds)).toMatch(/not known/);
    expect(eye.view).toBe('orbit');
    expect(eye.choose('wearer', wearer, bounds)).toBeUndefined();
    settle(eye);
    expect(distance(eye.worldFromCamera().translation, wearer.worldFromCamera.translation)).toBe(0);
    expect(eye.upright(640 / 480)).toBeCloseTo((2 * Math.atan(0.48) * 180) / Math.PI, 6);
    expect(eye.pictureM(0.1)).toBe(0);
    eye.rotate(0.3, 0);
    expect(eye.view).toBe('walk');
    settle(eye);
    const { translation } = eye.worldFromCamera();
    expect(distance(translation, wearer.worldFromCamera.translation)).toBeLessThan(1e-9);
    eye.stride = { right: 0, forward: 1 };
    settle(eye);
    eye.stride = { right: 0, forward: 0 };
    const after = eye.worldFromCamera().translation;
    expect(after.y).toBeCloseTo(-1.5, 9); // at the same height
    expect(distance(after, translation)).toBeCloseTo(0.6 * 2 * 0.64, 6);
    expect(after.x).toBeLessThan(translation.x); // what is grabbed goes right: the head turns left
  });

  test('looks down from above, and leaves that by hand alone', () => {
    const eye = new Viewpoint();
    eye.choose('above', wearer, bounds);
    settle(eye);
    const { translation } = eye.worldFromCamera();
    expect(translation.y).toBeLessThan(-4);
    expect(Math.hypot(translation.x, translation.z - 2)).toBeLessThan(0.4);
    eye.pan(0.1, 0.1);
    expect(eye.view).toBe('above');
    eye.rotate(0.1, -0.2);
    expect(eye.view).toBe('orbit');
  });
});
