// What several clicks make in the window: a box and a plane measured, a model registered by pairs, guides laid,
// a thing on a marker that nobody shows.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { FLOOR_Y, inMap, mm, pressButton, says, sleep, WALL_Z } from './things.mjs';

const ALONE_PX = 16; // of a feature: no other is meant by a click on it
const APART_PX = 50;
const OFF_M = [0.12, -0.06, 0.05]; // where the model is put before it is registered
const NEAR_M = 0.05; // features move while the map is made

const minus = (a, b) => a.map((value, i) => value - b[i]);
const length = (a) => Math.hypot(...a);
const objects = ({ ask }) => ask('scene', 'list').objects;
const named = (context, name) => objects(context).find((one) => one.name === name);

async function choose(context, words) {
  await pressButton(context, 'A click');
  await pressButton(context, words);
}

/** Features that a click in the map means, far from each other on the screen. */
function features(context, count, wanted = () => true) {
  const [paneX, paneY, width, height] = context.desktop.look().map.pane;
  const [insetX, insetY, insetWidth] = context.desktop.look().inset;
  const seen = context
    .map()
    .features.filter(({ depth_known }) => depth_known)
    .map(({ id, point_in_world_m: point, covariance_in_world_m2_upper: [xx, , , yy, , zz] }) => ({
      ...{ id, point, sigmaM: Math.sqrt(xx + yy + zz) },
      at: inMap(context, point),
    }))
    .filter(({ at }) => at);
  const away = (a, b) => length(minus(a.at, b.at));
  const inside = ([x, y]) =>
    x > paneX + 20 && y > paneY + 20 && x < paneX + width - 20 && y < paneY + height - 20;
  const covered = ([x, y]) => x < insetX + insetWidth + 20 && y > insetY - 20;
  const sigmas = seen.map(({ sigmaM }) => sigmaM).sort((a, b) => a - b);
  const sure = sigmas[Math.floor(0.6 * sigmas.length)]; // the others move while the map is made
  const free = seen.filter(
    (one) =>
      inside(one.at) &&
      one.sigmaM <= sure &&
      !covered(one.at) &&
      seen.every((other) => other === one || away(one, other) > ALONE_PX),
  );
  const chosen = [];
  const gap = (one) => Math.min(...chosen.map((other) => away(one, other)), 1e4);
  while (chosen.length < count) {
    const left = free.filter((one) => gap(one) > APART_PX && wanted(one, chosen));
    if (left.length === 0) break;
    chosen.push(left.reduce((best, one) => (gap(one) > gap(best) ? one : best)));
  }
  if (chosen.length < count) throw new Error(`${chosen.length} of ${count} features are free`);
  return chosen;
}

/** The map is eased to where it is to be seen from. */
async function standsStill({ desktop }) {
  for (let i = 0, before = ''; i < 40; ++i, await sleep(400)) {
    const eye = String(desktop.look().map.eye);
    if (eye === before) return;
    before = eye;
  }
}

async function clickPoint(context, point) {
  context.tells = context.desktop.look().things.tells;
  context.screen.click(inMap(context, point));
  await sleep(400);
}

/** Where it is now, and again where it has moved from under the pointer, as a person would. */
async function clickFeature(context, { id, point }) {
  for (let tries = 0; tries < 3; ++tries) {
    await context.desktop.until('tracking', ({ status }) => status.startsWith('tracking'), 30_000);
    const now = context.map().features.find((one) => one.id === id);
    await clickPoint(context, now?.point_in_world_m ?? point);
    const { tells } = context;
    const { things } = await context.desktop.until(
      'an answer',
      (shown) => shown.things.tells > tells,
    );
    if (!/nothing was measured/.test(things.said)) return;
  }
}

/** A box by two corners, a plane by three points, each a feature. */
export async function measured(context) {
  const { check, shot } = context;
  const [left, top, width, height] = context.desktop.look().map.pane;
  context.screen.press('h');
  context.screen.move([left + width / 2, top + height / 2]);
  await sleep(1500);
  for (const wheel of [4, 5]) context.screen.input('click', wheel); // held: it frames itself no more
  await standsStill(context);
  await sleep(4000); // the map becomes sure
  await choose(context, 'marks a box: 2 corners');
  const low = (one, [first]) =>
    !first || minus(one.point, first.point).every((d) => Math.abs(d) > 0.03);
  const [a, b] = features(context, 2, low);
  await clickFeature(context, a);
  shot('things-measuring');
  await clickFeature(context, b);
  const box = await says(context, /^box: |Not/);
  const off = length(
    minus(named(context, 'box')?.size_m ?? [9, 9, 9], minus(a.point, b.point).map(Math.abs)),
  );
  check('a box is measured by two corners', off < NEAR_M, `"${box}", ${mm(off)} from the features`);
  await choose(context, 'marks a plane: 3 points');
  const corners = features(context, 3);
  for (const corner of corners) await clickFeature(context, corner);
  const plane = await says(context, /^plane: |Not/);
  const side = length(minus(corners[1].point, corners[0].point));
  const wide = named(context, 'plane')?.size_m[0] ?? NaN;
  check(
    'a plane is measured by three points',
    Math.abs(wide - side) < NEAR_M,
    `"${plane}", ${mm(wide - side)}`,
  );
  for (const name of ['box', 'plane']) context.ask('scene', 'remove', named(context, name).id);
}

/** A GLB file of triangles over these points: y up, z to the viewer. */
function glbOf(points) {
  const corners = points.flatMap(([x, y, z]) => [x, -y, -z]);
  const binary = Buffer.concat([
    Buffer.from(new Float32Array(corners).buffer),
    Buffer.from(new Uint32Array([0, 1, 2, 0, 2, 3]).buffer),
  ]);
  const range = (pick) =>
    [0, 1, 2].map((axis) => pick(...corners.filter((_, i) => i % 3 === axis).map(Math.fround)));
  const root = {
    ...{ asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }] },
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count: 4,
        type: 'VEC3',
        min: range(Math.min),
        max: range(Math.max),
      },
      { bufferView: 1, componentType: 5125, count: 6, type: 'SCALAR' },
    ],
    bufferViews: [
      { buffer: 0, byteOffset: 0, byteLength: 48 },
      { buffer: 0, byteOffset: 48, byteLength: 24 },
    ],
    buffers: [{ byteLength: binary.length }],
  };
  const text = JSON.stringify(root);
  const json = Buffer.from(text.padEnd(4 * Math.ceil(text.length / 4)));
  const head = (...words) => Buffer.from(Uint32Array.from(words).buffer);
  return Buffer.concat([
    head(0x46546c67, 2, 12 + 8 + json.length + 8 + binary.length),
    head(json.length, 0x4e4f534a),
    json,
    head(binary.length, 0x004e4942),
    binary,
  ]);
}

/** A model of four features, put beside them, finds its way back by four pairs of clicks. */
export async function registered(context) {
  const { ask, check, desktop, folder, shot } = context;
  const four = features(context, 4);
  const points = four.map(({ point }) => point);
  const file = join(folder, 'four.glb');
  writeFileSync(file, glbOf(points));
  ask('scene', 'add', '--model', file, '--name', 'four', '--at', OFF_M.join(','));
  await desktop.until('the model is listed', ({ things }) => things.buttons['four · real']);
  await sleep(500); // it is drawn
  await pressButton(context, 'four · real');
  await choose(context, 'registers the selected: 4 points');
  for (const [i, point] of points.entries()) {
    await clickPoint(
      context,
      point.map((value, axis) => value + OFF_M[axis]),
    );
    await says(context, /the same point|Not/);
    await clickFeature(context, four[i]);
    await desktop.until(`pair ${i + 1}`, ({ things }) => things.pairs === i + 1, 5000);
  }
  const told = await desktop.until(
    'its error',
    ({ things }) => !/asking|more/.test(things.total),
    15_000,
  );
  const before = length(minus(named(context, 'four').position_m, OFF_M));
  shot('things-registered');
  await pressButton(context, 'Accept');
  const words = await says(context, /registered|Not/);
  const { position_m: at } = named(context, 'four');
  const errorMm = Number(/error ([\d.]+) mm/.exec(told.things.total)?.[1] ?? NaN);
  check(
    'a model is registered by pairs of points, its error shown before it is moved',
    before < 1e-9 && length(at) < NEAR_M && errorMm < 1000 * NEAR_M,
    `"${told.things.total}", then "${words}"; ${mm(length(at))} from where it belongs, ${mm(length(OFF_M))} before`,
  );
  ask('scene', 'remove', named(context, 'four').id);
  await desktop.until('the model is gone', ({ things }) => things.count === 1);
}

/** Koller's figure 7: a grid, a way, a pipe in the wall, an arrow. */
export async function explained(context) {
  const { check, shot } = context;
  const floor = (x, z) => [x, FLOOR_Y, z];
  const wall = (x, y) => [x, y, WALL_Z];
  const overlays = [
    ['grid', 'lays a grid on a floor: 1 point', [floor(0.2, -2.2)]],
    ['route', 'marks a way: points, then Done', [floor(0.1, -2.4), floor(0.5, -1.9)]],
    ['pipe', 'shows a pipe in a wall: points, then Done', [wall(-0.6, 0.4), wall(-0.1, 0.4)]],
    ['pointer', 'lets an arrow point there: 1 point', [wall(-0.4, 0.7)]],
  ];
  const said = [];
  for (const [, words, points] of overlays) {
    await choose(context, words);
    for (const point of points) await clickPoint(context, point);
    if (points.length > 1) await pressButton(context, 'Done');
    said.push(await says(context, /is there|Not/));
  }
  const materials = overlays.map(([name]) => named(context, name)?.material).join();
  const deep = (named(context, 'pipe')?.position_m[2] ?? NaN) - WALL_Z;
  check(
    'grid, way, pipe and arrow are laid by clicks',
    materials === 'guide,guide,hidden,guide' && Math.abs(deep - 0.05) < 0.01,
    `${materials}; pipe ${mm(deep)} in the wall; "${said.join('"; "')}"`,
  );
  shot('things-explained');
}

/** Nobody shows the marker: said, and taken back. */
export async function fixed(context) {
  const { check, shot } = context;
  await pressButton(context, 'shelf · virtual');
  await pressButton(context, 'Moves with a marker');
  await pressButton(context, 'Fix');
  shot('things-marker');
  const words = await says(context, /not seen within|moves with/);
  const { marker } = named(context, 'shelf');
  check(
    'a thing whose marker nobody shows stays where it is, and that is said',
    /not seen within 6 s/.test(words) && marker === null,
    `"${words}", marker ${JSON.stringify(marker)}`,
  );
  await pressButton(context, 'Moves with a marker');
}
