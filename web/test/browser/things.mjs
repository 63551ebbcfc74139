// Things of the scene: a room that is registered by clicks in the map, a shelf that is pushed to its wall and
// sinks to the floor, its place as the panel reads it; what is refused, a file that is dropped, a viewer, keys.
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { SceneMaterial, SceneService, SceneShape } from '../../src/gen/saccade/v1/scene_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { barriers } from './axe.mjs';
import { Expert } from './expert.mjs';
import { inCamera, inWorld, length, minus } from './optics.mjs';
import { startServer } from './server.mjs';
import { occluded } from './things_occlusion.mjs';
import { explained, numbered, slid } from './things_more.mjs';
import { asViewer } from './together.mjs';

export const CONTACT_M = 1e-3;
const SHELF_M = [1, 1.8, 0.3];
// The simulator's room about its chessboard: WorldFromRoom in server/sim/wearer.cpp.
const ROOM = { size: [4, 2.5, 4], base: [0.16, 1.22, -1.992] };
export const WALL_Z = 0.008;
export const LEFT_X = -1.84;
export const FLOOR_Y = 1.22;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runThings({ server: binary, chromium, seed, shots, folder }) {
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand&fps=10`],
    ...['--data-dir', join(folder, 'things-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.scene = createClient(SceneService, transport);
    context.map = createClient(MapService, transport);
    const session = createClient(SessionService, transport);
    const joined = await session.join({ displayName: 'test', role: Role.EXPERT });
    context.sessionId = joined.sessionId;
    context.intrinsics = joined.intrinsics;
    context.ann = await Expert.open(chromium, `${server.http}/?name=Ann`);
    await context.ann.waitForStatus(/^tracking/, 60_000);
    await context.ann.page.locator('canvas.map[data-eye]').waitFor();
    await room(context);
    await occluded(context);
    await pushed(context);
    await refused(context);
    await dragged(context);
    await slid(context);
    await undone(context);
    await dropped(context);
    await explained(context);
    await numbered(context);
    await barrier(context);
    await viewer(context);
    const { errors } = context.ann;
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    await context.ann?.close();
    await server.stop();
  }
  return context.failures;
}

export const shot = async ({ ann, shots }, name) => {
  if (shots) await ann.page.screenshot({ path: join(shots, `things-${name}.png`) });
};

export async function when(found, timeoutMs = 10_000) {
  for (const end = Date.now() + timeoutMs; Date.now() < end; await sleep(60)) {
    const result = await found();
    if (result) return result;
  }
  return undefined;
}

export const panel = ({ ann }) => ann.page.locator('section.things');
export const said = (context) => panel(context).locator('.said').innerText();
const place = (context) => panel(context).locator('.place').innerText();
export const objects = async ({ scene, sessionId }) =>
  (await scene.listScene({ sessionId })).objects;
export const xyz = ({ parentFromObject: { translationM: t } }) => [t.x, t.y, t.z];
export const does = (context, value) =>
  panel(context).locator('select').first().selectOption(value);

/** Where a point of the world appears on the page in the map. */
export async function inMap({ ann }, point) {
  const { pose, focal, left, top, width, height } = await ann.mapView();
  const [a, b, c] = inCamera(pose, point);
  return [left + width / 2 + (focal * a) / c, top + height / 2 + (focal * b) / c];
}

/** Features of the map that are free to be clicked, far from each other. */
async function features(context, count) {
  const { map } = await context.map.get({ sessionId: context.sessionId });
  const all = map.upserted;
  const box = await panel(context).boundingBox();
  const chosen = [];
  for (const { pointInWorldM: p, depthKnown } of all) {
    if (!depthKnown || chosen.length === count) continue;
    const at = await inMap(context, [p.x, p.y, p.z]);
    const free = at[0] > box.x + box.width + 20 && (await context.ann.isOver('.map3d', at));
    const far = chosen.every((other) => Math.hypot(other.at[0] - at[0], other.at[1] - at[1]) > 45);
    if (free && far) chosen.push({ at, point: [p.x, p.y, p.z] });
  }
  return chosen;
}

/** Another session adds the room, displaced: the page hears of it, and a person registers it. */
async function room(context) {
  const { ann, scene, sessionId, check } = context;
  await scene.putObject({
    sessionId,
    object: {
      ...{ name: 'room', shape: SceneShape.ROOM, material: SceneMaterial.REAL },
      sizeM: { x: ROOM.size[0], y: ROOM.size[1], z: ROOM.size[2] },
      parentFromObject: {
        rotation: { x: 0, y: 0, z: 0, w: 1 },
        translationM: { x: ROOM.base[0], y: ROOM.base[1], z: ROOM.base[2] },
      },
    },
  });
  const begin = Date.now();
  await ann.press('4');
  const row = panel(context).locator('li button', { hasText: 'room' });
  await row.waitFor();
  const heardMs = Date.now() - begin;
  check('the page hears of what another session adds', heardMs < 3000, `${heardMs} ms`);
  await shot(context, 'room');
}

/** Until the panel says something like this; what it says. */
export async function says(context, pattern, timeoutMs = 12_000) {
  await when(async () => pattern.test(await said(context)), timeoutMs);
  return said(context);
}

/** Corners of the shelf as the server has it. */
export function cornersOf({ parentFromObject: { rotation: q, translationM: t } }) {
  const pose = { rotation_xyzw: [q.x, q.y, q.z, q.w], translation_m: [t.x, t.y, t.z] };
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
    inWorld(pose, [
      (i & 1 ? 0.5 : -0.5) * SHELF_M[0],
      i & 2 ? -SHELF_M[1] : 0,
      (i & 4 ? 0.5 : -0.5) * SHELF_M[2],
    ]),
  );
}

export const mm = (m) => `${(1000 * m).toFixed(2)} mm`;
export const shelfOf = async (context) =>
  (await objects(context)).find(({ name }) => name === 'shelf');

async function pushed(context) {
  const { ann, check } = context;
  await does(context, 'library shelf');
  const box = await ann.page.locator('.map3d').boundingBox();
  await ann.page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  for (let i = 0; i < 8; ++i) await ann.page.mouse.wheel(0, 100);
  await sleep(900);
  const spot = await inMap(context, [0.7, FLOOR_Y, -1.3]);
  await ann.click(spot);
  const placed = await says(context, /rests on|Not done/);
  const first = await shelfOf(context);
  const sunk = first && Math.abs(Math.max(...cornersOf(first).map(([, y]) => y)) - FLOOR_Y);
  check('a shelf that is let go stands on the floor', sunk < CONTACT_M, `${placed}; ${mm(sunk)}`);
  await shot(context, 'placed');

  await ann.press('4'); // the keyboard goes to the panel
  await ann.press('Tab');
  await panel(context).locator('button[aria-label="Push away"]').focus();
  await ann.press('ArrowUp');
  const stopped = await says(context, /touches|Not/);
  const shelf = await shelfOf(context);
  const corners = cornersOf(shelf);
  const gap = WALL_Z - Math.max(...corners.map(([, , z]) => z));
  const rest = FLOOR_Y - Math.max(...corners.map(([, y]) => y));
  check(
    'pushed by a key it stops at the wall and sinks to the floor',
    gap >= 0 && gap < CONTACT_M && rest >= 0 && rest < CONTACT_M && /touches room/.test(stopped),
    `"${stopped}", ${mm(gap)} from the wall, ${mm(rest)} over the floor`,
  );
  const read = await place(context);
  const numbers = [...read.matchAll(/[xyz] (-?[\d.]+)/g)].map(([, number]) => Number(number));
  const off = length(minus(numbers, xyz(shelf)));
  check('its place is read in metres', numbers.length === 3 && off < 2e-4, `"${read}"`);
  await shot(context, 'at-the-wall');

  context.shelf = shelf;
}

async function refused(context) {
  const { ann, check } = context;
  await does(context, 'library shelf');
  await ann.click(await inMap(context, xyz(context.shelf)));
  const why = await says(context, /Not done/);
  const count = (await objects(context)).length;
  check(
    'a place that is taken is refused in words',
    /inside of 'shelf'/.test(why) && count === 2,
    why,
  );
  await shot(context, 'refused');
}

/** Pulled by the mouse it goes where it is pulled, to the other wall. */
async function dragged(context) {
  const { ann, check, shelf } = context;
  await does(context, 'select');
  const centre = (await inMap(context, xyz(shelf))).map((value, i) => value - (i === 1 ? 12 : 0));
  const [x, y, z] = xyz(shelf);
  const [from, to] = [await inMap(context, [x, y, z]), await inMap(context, [x - 0.8, y, z - 0.1])];
  await ann.page.mouse.move(...centre);
  await ann.page.mouse.down();
  await ann.page.mouse.move(centre[0] + to[0] - from[0], centre[1] + to[1] - from[1], {
    steps: 4,
  });
  await shot(context, 'dragged');
  await ann.page.mouse.up();
  const moved = await when(async () => {
    const now = await shelfOf(context);
    return length(minus(xyz(now), xyz(shelf))) > 0.1 && now;
  });
  const side = moved && Math.min(...cornersOf(moved).map(([x]) => x)) - LEFT_X;
  check(
    'dragged to the left it stops at the other wall',
    side >= 0 && side < CONTACT_M,
    `${side === undefined ? 'it did not move' : mm(side)}; "${await said(context)}"`,
  );
  context.shelf = moved || shelf;
}

/** The last changes, one after the other. */
async function undone(context) {
  const { ann, check } = context;
  await ann.page.locator('.map3d').focus();
  const before = xyz(context.shelf);
  await ann.press('z');
  const back = await when(async () => length(minus(xyz(await shelfOf(context)), before)) > 0.1);
  await panel(context).locator('li button', { hasText: 'shelf' }).click();
  await ann.press('Delete');
  const gone = await when(async () => !(await shelfOf(context)));
  await says(context, /deleted/); // one change at a time
  await ann.press('z');
  const again = await when(async () => Boolean(await shelfOf(context)));
  check(
    'undo puts it back, delete takes it away, undo brings it again',
    back && gone && again,
    `${Boolean(back)}, ${Boolean(gone)}, ${Boolean(again)}`,
  );
}

/** A GLB file of a strip of triangles through these points of our frame [m]. */
function glbOf(points) {
  const positions = Buffer.alloc(12 * points.length);
  points.forEach(([x, y, z], i) =>
    [x, -y, -z].forEach((value, k) => positions.writeFloatLE(value, 12 * i + 4 * k)),
  );
  const corners = points.slice(2).flatMap((_, i) => [i, i + 1, i + 2]);
  const indices = Buffer.alloc(4 * Math.ceil(corners.length / 2));
  corners.forEach((corner, i) => indices.writeUInt16LE(corner, 2 * i));
  const axis = (k) => points.map((p) => (k === 0 ? 1 : -1) * Math.fround(p[k]));
  const json = {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    accessors: [
      {
        ...{ bufferView: 0, componentType: 5126, count: points.length, type: 'VEC3' },
        min: [0, 1, 2].map((k) => Math.min(...axis(k))),
        max: [0, 1, 2].map((k) => Math.max(...axis(k))),
      },
      { bufferView: 1, componentType: 5123, count: corners.length, type: 'SCALAR' },
    ],
    bufferViews: [
      { buffer: 0, byteLength: positions.length },
      { buffer: 0, byteOffset: positions.length, byteLength: 2 * corners.length },
    ],
    buffers: [{ byteLength: positions.length + indices.length }],
  };
  const text = JSON.stringify(json);
  const head = Buffer.from(text.padEnd(4 * Math.ceil(text.length / 4)));
  const chunk = (type, data) => {
    const header = Buffer.alloc(8);
    header.writeUInt32LE(data.length, 0);
    header.writeUInt32LE(type, 4);
    return Buffer.concat([header, data]);
  };
  const body = Buffer.concat([
    chunk(0x4e4f534a, head),
    chunk(0x004e4942, Buffer.concat([positions, indices])),
  ]);
  const start = Buffer.alloc(12);
  start.write('glTF', 0, 'latin1');
  start.writeUInt32LE(2, 4);
  start.writeUInt32LE(12 + body.length, 8);
  return Buffer.concat([start, body]);
}

/** Lets go of a file over the map, as a file manager does. */
const dropFile = ({ ann }, [x, y], name, bytes) =>
  ann.page.evaluate(
    ([left, top, fileName, data]) => {
      const transfer = new window.DataTransfer();
      transfer.items.add(new window.File([new Uint8Array(data)], fileName));
      const target = document.elementFromPoint(left, top).closest('.pane');
      const where = { bubbles: true, cancelable: true, clientX: left, clientY: top };
      for (const type of ['dragenter', 'dragover', 'drop']) {
        target.dispatchEvent(new window.DragEvent(type, { ...where, dataTransfer: transfer }));
      }
    },
    [x, y, name, [...bytes]],
  );

/** A file whose corners are features of the map: dropped, it falls to the floor; then it is registered. */
async function dropped(context) {
  const { ann, check } = context;
  const chosen = await features(context, 5);
  const low = Math.max(...chosen.map(({ point }) => point[1]));
  const middle = [0, 2].map((k) => chosen.reduce((sum, { point }) => sum + point[k] / 5, 0));
  const inObject = ({ point: [x, y, z] }) => [x - middle[0], y - low, z - middle[1]];
  const bytes = glbOf(chosen.map(inObject));
  await dropFile(
    context,
    await inMap(context, [0.6, FLOOR_Y, -1.4]),
    'torn.glb',
    bytes.slice(0, 90),
  );
  const torn = await says(context, /Not done/);
  await dropFile(context, await inMap(context, [0.6, FLOOR_Y, -1.4]), 'machine.glb', bytes);
  const fell = await says(context, /rests on/);
  check(
    'a GLB file that is dropped falls to the floor; a torn one is refused in words',
    /machine rests on room/.test(fell) && torn.length > 20,
    `"${fell}"; "${torn}"`,
  );
  await does(context, 'register');
  const machine = (await objects(context)).find(({ name }) => name === 'machine');
  const { rotation: q, translationM: t } = machine.parentFromObject;
  const pose = { rotation_xyzw: [q.x, q.y, q.z, q.w], translation_m: [t.x, t.y, t.z] };
  for (const [i, one] of chosen.entries()) {
    await says(context, new RegExp(`^Point ${i + 1}: click a corner`));
    await ann.click(await inMap(context, inWorld(pose, inObject(one))));
    await says(context, new RegExp(`^Point ${i + 1}: click the same`));
    await ann.click(await inMap(context, one.point));
  }
  await says(context, /^Point 6/);
  const total = await panel(context).locator('.total').innerText();
  await shot(context, 'registering');
  const still = (await objects(context)).find(({ name }) => name === 'machine');
  await panel(context).getByRole('button', { name: 'Accept' }).click();
  const accepted = await says(context, /registered/);
  const there = (await objects(context)).find(({ name }) => name === 'machine');
  const { rotation: r, translationM: u } = there.parentFromObject;
  const now = { rotation_xyzw: [r.x, r.y, r.z, r.w], translation_m: [u.x, u.y, u.z] };
  const errors = chosen.map((one) => length(minus(inWorld(now, inObject(one)), one.point)));
  const rms = Number(/error ([\d.]+) mm/.exec(total)?.[1]);
  check(
    'five clicked correspondences register it; the error is shown before it is accepted',
    rms < 10 && Math.max(...errors) < 0.02 && length(minus(xyz(still), xyz(machine))) < 1e-9,
    `"${total}"; then "${accepted}"; corners within ${mm(Math.max(...errors))}`,
  );
  await measured(context, chosen);
}

/** A plane by three features, a box by two. */
async function measured(context, chosen) {
  const { ann, check } = context;
  const click = async (one, next) => {
    await ann.click(await inMap(context, one.point));
    return says(context, next);
  };
  await does(context, 'plane');
  await click(chosen[0], /point 2/);
  await click(chosen[1], /point 3/);
  const plane = await click(chosen[2], /^plane: |^Not/);
  await does(context, 'box');
  const [a, b] = [chosen[0], chosen.find(({ point }) => isApart(point, chosen[0].point))];
  await click(a, /corner 2/);
  const box = b ? await click(b, /^box: |^Not/) : 'no two features far enough apart';
  const list = await objects(context);
  const found = (name) => list.find((one) => one.name === name);
  const { rotation: q, translationM: t } = found('plane')?.parentFromObject ?? {};
  const pose = q && { rotation_xyzw: [q.x, q.y, q.z, q.w], translation_m: [t.x, t.y, t.z] };
  const off = pose
    ? Math.max(...chosen.slice(0, 3).map(({ point }) => Math.abs(inCamera(pose, point)[1])))
    : Infinity;
  check(
    'three clicks are a plane, two a box',
    off < 0.02 && Boolean(found('box')),
    `"${plane}", ${mm(off)} off the features; "${box}"`,
  );
  await shot(context, 'measured');
}

const isApart = (p, q) => p.every((value, k) => Math.abs(value - q[k]) > 0.015);

async function barrier(context) {
  const { ann, check } = context;
  const found = await barriers(ann.page);
  check('axe', found.length === 0, found.join('; ') || 'none');
  await ann.enlarge('video');
  await sleep(800);
  await shot(context, 'video');
  await ann.press('Escape');
  const hidden = await when(async () => !(await panel(context).isVisible()));
  check('Escape leaves the tool', hidden === true, String(hidden));
}

/** Who may only look reads the place, and is told why nothing moves. */
async function viewer(context) {
  const { ann, check } = context;
  const { page } = ann;
  await page.route('**/saccade.v1.SessionService/Join', async (route) => {
    await route.continue({ postData: asViewer(Buffer.from(route.request().postDataBuffer())) });
  });
  await page.evaluate(() => sessionStorage.clear());
  await page.reload();
  await ann.waitForStatus(/^tracking/, 30_000);
  await ann.press('4');
  await panel(context).locator('li button', { hasText: 'shelf' }).click();
  const before = xyz(await shelfOf(context));
  await panel(context).locator('button[aria-label="Push right"]').click();
  await sleep(700);
  const words = await said(context);
  const read = await place(context);
  const moved = length(minus(xyz(await shelfOf(context)), before));
  check(
    'a viewer, whom the stream tells the scene as it is, reads and moves nothing',
    /^You are a viewer/.test(words) && /^shelf: x/.test(read) && moved === 0,
    `"${words}"; "${read}"`,
  );
}
