// What a room of 300 000 triangles and 100 marks costs the page: the real page and server, but for the answers of
// SurfaceService, which are made here. By hand: frame rate, processor time of a frame, memory.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { create, toBinary } from '@bufbuild/protobuf';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { MeshoptEncoder } from 'meshoptimizer';
import { AnnotationService, AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { GetSurfaceResponseSchema } from '../../src/gen/saccade/v1/surface_pb.js';
import { Expert } from './expert.mjs';
import { startServer } from './server.mjs';

const SIDE = 32; // voxels of a chunk
const VOXEL = 1760; // steps
const STEP_M = 0.015 / VOXEL;
const CHUNK_M = SIDE * VOXEL * STEP_M;
const WALL = 5; // chunks
const MARKS = 100;
const FRAMES = 40;
const MEASURE_MS = 45_000; // at most
const TICKS_A_SECOND = 100; // of /proc

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** One chunk of a wall across `axis`, with waves of a few millimetres. */
function chunk(name, originInWorldM, axis) {
  const corners = (SIDE + 1) ** 2;
  const packed = new Uint8Array(12 * corners);
  const data = new DataView(packed.buffer);
  const indices = [];
  for (let row = 0; row <= SIDE; ++row) {
    for (let column = 0; column <= SIDE; ++column) {
      const i = row * (SIDE + 1) + column;
      const wave = 900 + 300 * Math.sin(row / 5) * Math.cos(column / 4);
      const place = [column * VOXEL, row * VOXEL];
      place.splice(axis, 0, wave);
      place.forEach((value, k) => data.setUint16(12 * i + 2 * k, value, true));
      packed.set([90 + 4 * row, 80 + 4 * column, (row ^ column) % 8 < 4 ? 200 : 120], 12 * i + 6);
      if (row < SIDE && column < SIDE) {
        indices.push(i, i + 1, i + SIDE + 1, i + 1, i + SIDE + 2, i + SIDE + 1);
      }
    }
  }
  const [x, y, z] = originInWorldM;
  return {
    ...{ ...name, originInWorldM: { x, y, z }, stepM: STEP_M },
    ...{ cornerCount: corners, triangleCount: indices.length / 3 },
    corners: MeshoptEncoder.encodeVertexBuffer(packed, corners, 12),
    triangles: MeshoptEncoder.encodeIndexBuffer(
      new Uint8Array(Uint16Array.from(indices).buffer),
      indices.length,
      2,
    ),
  };
}

/** Six walls. */
function room() {
  const chunks = [];
  const half = (WALL * CHUNK_M) / 2;
  for (let side = 0; side < 6; ++side) {
    const axis = side >> 1;
    for (let i = 0; i < WALL * WALL; ++i) {
      const origin = [(i % WALL) * CHUNK_M - half, Math.floor(i / WALL) * CHUNK_M - half];
      origin.splice(axis, 0, side & 1 ? half : -half);
      origin[2] += 0.6;
      chunks.push(chunk({ x: side, y: i, z: 0 }, origin, axis));
    }
  }
  return chunks;
}

/** gRPC-Web's frames of one answer. */
function answered(message) {
  const frame = (flag, bytes) => {
    const head = Buffer.alloc(5);
    head[0] = flag;
    head.writeUInt32BE(bytes.length, 1);
    return Buffer.concat([head, bytes]);
  };
  return Buffer.concat([frame(0, message), frame(0x80, Buffer.from('grpc-status: 0\r\n'))]);
}

/** Processor time [s], of it the software GPU's, and memory [MB] of the browser's processes. */
function costs(profile) {
  let [ticks, gpu, pages] = [0, 0, 0];
  for (const pid of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const command = readFileSync(`/proc/${pid}/cmdline`, 'utf8');
      if (!/chromium/.test(command) || !isOf(pid, profile)) continue;
      const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
      const used = Number(fields[11]) + Number(fields[12]);
      ticks += used;
      if (command.includes('--type=gpu-process')) gpu += used;
      pages += Number(readFileSync(`/proc/${pid}/statm`, 'utf8').split(' ')[1]);
    } catch {
      // It has ended meanwhile.
    }
  }
  return {
    seconds: ticks / TICKS_A_SECOND,
    gpu: gpu / TICKS_A_SECOND,
    megabytes: (4 * pages) / 1024,
  };
}

/** True for the browser with that profile and all it started. */
function isOf(pid, profile) {
  for (let at = pid; at !== '0' && at !== '1'; ) {
    if (readFileSync(`/proc/${at}/cmdline`, 'utf8').includes(profile)) return true;
    at = readFileSync(`/proc/${at}/stat`, 'utf8').split(') ')[1].split(' ')[1];
  }
  return false;
}

export async function runSurfacesLoad({ server: binary, chromium, seed, folder, shots }) {
  await MeshoptEncoder.ready;
  const chunks = room();
  const message = { edition: 7n, version: BigInt(chunks.length), chunks };
  const body = toBinary(GetSurfaceResponseSchema, create(GetSurfaceResponseSchema, message));
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand&fps=5`, '--surface-cores', '0'],
    ...['--data-dir', join(folder, 'load-data'), '--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  let expert;
  let failures = 0;
  try {
    expert = await Expert.open(chromium, server.http, { look: '' });
    const { page, profile } = expert;
    await expert.waitForStatus(/^tracking/, 60_000);
    await page.locator('canvas.map[data-eye]').waitFor();
    await mark(server, MARKS);
    const dots = await measured(expert, profile);
    await page.route('**/saccade.v1.SurfaceService/Get', (route) =>
      route.fulfill({ contentType: 'application/grpc-web+proto', body: answered(body) }),
    );
    const begin = Date.now();
    await page.reload();
    const count = chunks.reduce((sum, each) => sum + each.triangleCount, 0);
    await page.locator(`canvas.map[data-surfaces="${count}"]`).waitFor({ timeout: 90_000 });
    const cameMs = Date.now() - begin;
    if (shots) await page.screenshot({ path: join(shots, 'surfaces-load.png') });
    const surfaces = await measured(expert, profile);
    console.log(
      `      ${count} triangles, ${(body.length / 1e6).toFixed(2)} MB, there ${cameMs} ms`,
    );
    for (const [what, { fps, ms, gpuMs, megabytes }] of Object.entries({ dots, surfaces })) {
      console.log(
        `      ${what}: ${fps.toFixed(1)} frames/s, ${ms.toFixed(0)} ms of a processor each (GPU ${gpuMs.toFixed(0)}), ${megabytes.toFixed(0)} MB`,
      );
    }
    // Of processor time: what else runs here does not count.
    failures = surfaces.gpuMs < 200 ? 0 : 1;
    console.log(
      `${failures ? 'FAIL' : 'ok  '}  a frame of it costs the software GPU less than 200 ms of a processor`,
    );
  } finally {
    await expert?.close();
    await server.stop();
  }
  return failures;
}

async function mark(server, count) {
  const transport = createGrpcWebTransport({ baseUrl: server.http });
  const joined = await createClient(SessionService, transport).join({
    ...{ displayName: 'marks', role: Role.EXPERT },
  });
  const client = createClient(AnnotationService, transport);
  for (let i = 0; i < count; ++i) {
    const at = { x: ((i % 10) - 5) / 5, y: Math.floor(i / 10) / 5 - 1, z: 1 };
    await client.create({
      ...{ requestId: globalThis.crypto.randomUUID(), sessionId: joined.sessionId },
      draft: {
        ...{ shape: AnnotationShape.NOTE, text: `mark ${i}` },
        target: { target: { case: 'pointInWorldM', value: at } },
      },
    });
    await sleep(120); // a server takes a few a second from each
  }
}

/** With the map turning in every frame. */
async function measured({ page }, profile) {
  await sleep(3000);
  const before = costs(profile);
  const frames = await page.evaluate(
    ([most, ms]) =>
      new Promise((resolve) => {
        const map = document.querySelector('.map3d');
        const begin = performance.now();
        let frames = 0;
        const turn = () => {
          map.dispatchEvent(new window.KeyboardEvent('keydown', { key: 'ArrowRight' }));
          if (frames === most || performance.now() - begin > ms) {
            return resolve({ frames, ms: performance.now() - begin });
          }
          ++frames;
          window.requestAnimationFrame(turn);
        };
        window.requestAnimationFrame(turn);
      }),
    [FRAMES, MEASURE_MS],
  );
  const after = costs(profile);
  const seconds = after.seconds - before.seconds;
  return {
    fps: (1000 * frames.frames) / frames.ms,
    ms: (1000 * seconds) / frames.frames,
    gpuMs: (1000 * (after.gpu - before.gpu)) / frames.frames,
    megabytes: after.megabytes,
  };
}
