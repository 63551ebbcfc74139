import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService } from '../../src/gen/saccade/v1/annotation_pb.js';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { VideoView } from '../../src/gen/saccade/v1/video_pb.js';
import { clickedPoint } from './clicked.mjs';
import { Expert } from './expert.mjs';
import { frozenPicture } from './freeze.mjs';
import { checkMaps } from './maps.mjs';
import { checkRecorded } from './recorded.mjs';
import { AT_OUTLINES } from './outlines.mjs';
import { CLEAR, displacement, REACH_PX } from './outline.mjs';
import { cubePixels, inCamera, length, minus, project } from './optics.mjs';
import { decodePng, median, pixelsOf, psnr } from './pictures.mjs';
import { renderDepths, renderTruth, startServer, Truth } from './server.mjs';

const ACCENT = [0xc4, 0xb0, 0xff]; // the selected mark
const CUBE_M = 0.05;
const PICTURES = 10;
const PER_PANE = 10;
const MAPPED_M = 0.05; // in the map one can only click what it shows: a feature this near to the object

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runChecks({
  server: binary,
  evaluator,
  chromium,
  seed,
  shots,
  folder,
  port,
}) {
  const source = `sim:desk?seed=${seed}`;
  const truthFile = join(folder, 'truth.jsonl');
  const start = () =>
    startServer(binary, [
      // In real time: at whatever pace a quick computer manages the wearer moves too fast to be clicked.
      ...['--source', source, '--sim-truth', truthFile],
      ...[
        '--grpc',
        '127.0.0.1:0',
        '--http',
        `127.0.0.1:${port}`,
        '--data-dir',
        join(folder, 'data'),
      ],
    ]);
  const context = { failures: 0, shots, server: await start() };
  context.render = (id) => renderTruth(evaluator, source, id, join(folder, 'truth'));
  context.depths = (id) => renderDepths(evaluator, source, id, join(folder, 'depths'));
  let since = Date.now();
  context.check = (name, ok, figures) => {
    const seconds = ((Date.now() - since) / 1000).toFixed(0);
    since = Date.now();
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures} [${seconds} s]`);
    if (!ok) ++context.failures;
  };
  try {
    const transport = createGrpcWebTransport({ baseUrl: context.server.http });
    context.session = createClient(SessionService, transport);
    context.annotations = createClient(AnnotationService, transport);
    context.map = createClient(MapService, transport);
    const joined = await context.session.join({ displayName: 'test' });
    context.camera = joined.intrinsics;
    context.truth = new Truth(truthFile);
    context.expert = await Expert.open(chromium, context.server.http);
    await context.expert.waitForStatus(/^tracking/, 60_000);
    await context.expert.page.locator('.app[data-first-picture-ms]').waitFor();
    await firstPicture(context);
    await decodedPictures(context);
    await clicks(context);
    await drawnCubes(context);
    await frozenPicture(context);
    if (!process.env['SACCADE_VERBOSE']) await restart(context, start);
    await checkRecorded({ ...context, sleep, shot: (name) => shot(context, name) });
    await checkMaps({ ...context, sleep, shot: (name) => shot(context, name) });
    context.check(
      'page errors',
      context.expert.errors.length === 0,
      context.expert.errors.join('; ') || 'none',
    );
  } finally {
    await context.expert?.close();
    await context.server.stop();
  }
  return context.failures;
}

async function shot({ shots, expert }, name) {
  if (shots) await expert.page.screenshot({ path: join(shots, `${name}.png`) });
}

async function firstPicture({ expert, check }) {
  const ms = Number(await expert.page.locator('.app').getAttribute('data-first-picture-ms'));
  // One second on an ordinary laptop; here two cores share simulator, tracker and a software GPU.
  check('first picture', ms > 0 && ms < 5000, `${ms} ms after the page began to load`);
}

/** What the browser decoded against the simulator's own drawing, without noise, of that frame. */
async function decodedPictures({ expert, session, check, render }) {
  const shownById = new Map();
  for (let tries = 0; shownById.size < PICTURES && tries < 10 * PICTURES; ++tries) {
    const { id, png } = await expert.picture();
    shownById.set(id, decodePng(png));
    await sleep(150);
  }
  // The server's own record of the last of them: the ids of both sides mean the same frame.
  const last = [...shownById.keys()].at(-1);
  const kept = await session.getFrame({ frameId: BigInt(last), view: VideoView.RAW });
  if (Number(kept.frameId) !== last) throw new Error('GetFrame answered another frame');
  const against = psnr(shownById.get(last), decodePng(kept.png));
  const ratios = [];
  for (const [id, shown] of shownById) ratios.push(psnr(shown, await render(id)));
  const worst = Math.min(...ratios);
  check(
    'decoded pictures against the truth render, PSNR above 30 dB',
    ratios.length === PICTURES && worst > 30,
    `${ratios.length} frames, worst ${worst.toFixed(1)} dB, median ${median(ratios).toFixed(1)} dB; ` +
      `against the camera's own picture ${against.toFixed(1)} dB`,
  );
}

const LIVE_HZ = 20; // at 15, two runs gave 0.8 and 2.8 %

/**
 * What the median of clicks may be off, as a share of the depth. Where browser, renderer and tracker share two
 * cores the tracker gets a third of the pictures, and a click lands in a map that has seen as little.
 */
function accuracyBar({ hz }) {
  const tracked = median(hz);
  const share = tracked < LIVE_HZ ? 0.05 : 0.02;
  return { share, words: `${100 * share} % of depth (${tracked} pictures tracked a second)` };
}

/** Twenty cubes, ten by the video and ten by the map, while the wearer moves. */
async function clicks(context) {
  const { expert, annotations, check } = context;
  context.placed = [];
  context.hz = [];
  await expert.press('c');
  await expert.enlarge('video');
  await placeMany(context, 'video', aimInVideo);
  await shot(context, 'video');
  await expert.enlarge('map');
  await placeMany(context, 'map', aimInMap);
  await shot(context, 'map');
  await expert.press('v');
  await sleep(1000);
  const { annotations: list } = await annotations.list({});
  const known = new Map(list.map((annotation) => [annotation.id, annotation.anchor]));
  const bar = accuracyBar(context);
  context.share = bar.share;
  for (const pane of ['video', 'map']) {
    const placed = context.placed.filter((entry) => entry.pane === pane);
    const errors = placed.map(({ id, point, depth }) => {
      const at = known.get(id)?.pointInWorldM;
      return at ? length(minus([at.x, at.y, at.z], point)) / depth : Infinity;
    });
    if (process.env['SACCADE_VERBOSE']) {
      for (const { id, name, point, depth } of placed) {
        const { pointInWorldM: p, method, state } = known.get(id) ?? {};
        const text = p ? [p.x, p.y, p.z].map((value) => value.toFixed(3)) : 'none';
        console.log(
          `      ${name}: ${text} for ${point.map((v) => v.toFixed(3))}, depth ${depth.toFixed(2)} m, method ${method}, state ${state}`,
        );
      }
    }
    const objects = new Set(placed.map(({ name }) => name)).size;
    check(
      `clicks in the ${pane}, median error below ${bar.words}`,
      placed.length >= PER_PANE && median(errors) < bar.share,
      `${placed.length} cubes on ${objects} objects, median ${(100 * median(errors)).toFixed(2)} %, ` +
        `worst ${(100 * Math.max(...errors)).toFixed(2)} %`,
    );
  }
}

async function placeMany(context, pane, aim) {
  const { expert, placed } = context;
  const used = new Map(); // object -> how often
  const refusals = [];
  let count = 0;
  for (const end = Date.now() + 300_000; count < PER_PANE && Date.now() < end; ) {
    const before = await expert.annotationIds();
    const click = await aim(context, used);
    if (!click) {
      await sleep(100);
      continue;
    }
    const { id, refused } = await expert.newAnnotation(before);
    if (refused) {
      refusals.push(refused);
      await sleep(500);
      continue;
    }
    const hit = await click.where();
    used.set(click.name, (used.get(click.name) ?? 0) + 1);
    if (!hit) {
      await expert.press('Control+z'); // missed: the wearer had moved on
      continue;
    }
    context.hz.push(await expert.trackedHz());
    placed.push({ id, pane, name: click.name, ...hit });
    ++count;
  }
  if (refusals.length > 0) console.log(`      refused ${refusals.length}: ${refusals[0]}`);
}

/** Objects with their truth in a frame, least used first. */
export const candidates = (frame, used) =>
  frame.objects
    .filter(({ name, visible, pixel }) => visible && pixel && !AT_OUTLINES.includes(name))
    .sort((a, b) => (used.get(a.name) ?? 0) - (used.get(b.name) ?? 0));

/**
 * A hand leads what moves: from how the object went these frames, where it will be when the press arrives. How
 * long that takes is learnt from press to press.
 */
const LEARNT_FRAMES = 6;
const leading = ({ truth, lag = 0 }, frame, { name, pixel }) => {
  const before = truth.frame(frame.frame - LEARNT_FRAMES)?.objects.find((o) => o.name === name);
  if (!before?.pixel) return pixel;
  return pixel.map((value, i) => value + ((value - before.pixel[i]) * lag) / LEARNT_FRAMES);
};

export async function aimInVideo(context, used) {
  const { expert, truth, camera, depths } = context;
  const { id, left, top, scale, width, height } = await expert.look();
  const frame = truth.frame(id);
  if (!frame) return undefined;
  for (const object of candidates(frame, used)) {
    const [u, v] = leading(context, frame, object);
    if (u < 30 || v < 30 || u > width - 30 || v > height - 30) continue;
    const at = [left + (u + 0.5) * scale, top + (v + 0.5) * scale];
    if (!(await expert.isOver('.video', at))) continue;
    await expert.click(at);
    const pressed = await expert.pressed();
    context.lag = ((context.lag ?? 0) + Math.min(30, pressed.id - id)) / 2;
    return {
      name: object.name,
      where: () => clickedPoint(pressed, truth, camera, object.name, depths),
    };
  }
  return undefined;
}

/** Of these objects those that the map shows something of. */
async function mappedOf({ map }, objects) {
  const { map: now } = await map.get({});
  const points = now.upserted
    .filter(({ depthKnown }) => depthKnown)
    .map(({ pointInWorldM: { x, y, z } }) => [x, y, z]);
  return objects.filter(({ point_in_world_m: at }) =>
    points.some((point) => length(minus(point, at)) < MAPPED_M),
  );
}

/** As a person would: turn the wheel over the object until it is near, then click it. */
export async function aimInMap(context, used) {
  const { expert, truth } = context;
  const { id } = await expert.look();
  const frame = truth.frame(id);
  if (!frame) return undefined;
  await expert.press('h');
  await sleep(400);
  const names = (await mappedOf(context, candidates(frame, used))).map(({ name }) => name);
  const found = await findInMap(expert, frame, names);
  if (!found) return undefined;
  await expert.page.mouse.move(...found.at);
  for (let i = 0; i < 8; ++i) await expert.page.mouse.wheel(0, -100);
  await sleep(600);
  const near = await findInMap(expert, frame, [found.name]);
  if (!near) return undefined;
  await expert.click(near.at);
  const point = near.point;
  const depth = inCamera(frame.world_from_camera, point)[2];
  return { name: near.name, at: near.at, where: () => Promise.resolve({ point, depth }) };
}

/** Where the first of these objects that can be clicked lies on the page. */
async function findInMap(expert, frame, names) {
  const view = await expert.mapView();
  const eye = {
    fxPx: view.focal,
    fyPx: view.focal,
    cxPx: view.width / 2,
    cyPx: view.height / 2,
    distortion: [],
  };
  for (const name of names) {
    const { point_in_world_m: point } = frame.objects.find((object) => object.name === name);
    const pixel = project(eye, inCamera(view.pose, point));
    if (!pixel) continue;
    const at = [view.left + pixel[0], view.top + pixel[1]];
    if (await expert.isOver('.map3d', at)) return { name, point, at };
  }
  return undefined;
}

/** The selected cube, found by its lines, against where truth puts it in that very frame. */
async function drawnCubes(context) {
  const { expert, check, placed } = context;
  await expert.enlarge('video');
  const errors = [];
  for (const entry of placed.filter(({ pane }) => pane === 'video')) {
    const row = expert.page.locator(`aside li[data-id="${entry.id}"]`);
    await row.locator('.pick').click();
    await expert.page.mouse.move(2, 2);
    await sleep(300);
    // Until it has been seen three times, as the wearer looks round; at most four seconds.
    for (let seen = 0, i = 0; seen < 3 && i < 20; ++i) {
      await sleep(200);
      if ((await row.innerText()).includes('do not trust')) continue;
      const error = await cubeError(context, entry);
      if (error === undefined) continue;
      if (process.env['SACCADE_VERBOSE']) {
        console.log(`      ${entry.name} ${error.toFixed(2)} px: ${await row.innerText()}`);
      }
      errors.push(error);
      ++seen;
    }
  }
  await shot(context, 'cubes');
  check(
    // What the click itself was off is in it: at an outline 4 % of the depth, 5 px seen from elsewhere.
    'drawn cubes within 3 px of what was clicked (6 where the tracker is slow)',
    errors.length >= 5 && median(errors) < (accuracyBar(context).share > 0.02 ? 6 : 3),
    `${errors.length} sightings, median ${median(errors)?.toFixed(2)} px, worst ${Math.max(...errors).toFixed(2)} px`,
  );
}

async function cubeError({ expert, truth, camera }, { point }) {
  const drawn = await expert.marks();
  const frame = truth.frame(drawn.id);
  if (!frame) return undefined;
  const wanted = cubePixels(camera, frame.world_from_camera, point, CUBE_M, 8);
  if (wanted.length === 0) return undefined;
  const { ratio, left, top, scale } = drawn;
  const found = pixelsOf(decodePng(drawn.png), ACCENT, 40).map(([x, y]) => [
    ((x + 0.5) / ratio - left) / scale - 0.5,
    ((y + 0.5) / ratio - top) / scale - 0.5,
  ]);
  const moved = displacement(wanted, found);
  if (moved) return length(moved);
  // A cube is drawn, but not there: that counts, too. Less of it: hidden, or out of view.
  return found.length > CLEAR * wanted.length ? REACH_PX : undefined;
}

/** The marks that the page lists, once they have stood for two seconds: edits may be on their way. */
async function settledIds(expert) {
  let ids = [];
  for (let steady = 0, tries = 0; steady < 4 && tries < 40; ++tries) {
    const now = (await expert.annotationIds()).sort();
    steady = now.join() === ids.join() ? steady + 1 : 0;
    ids = now;
    await sleep(500);
  }
  return ids;
}

/** What one list has and the other has not, in words; 'the same' if nothing. */
function difference(left, right) {
  const lacking = left.filter((id) => !right.includes(id));
  const added = right.filter((id) => !left.includes(id));
  const words = (ids, word) => (ids.length > 0 ? [`${word} ${ids.join(' ')}`] : []);
  return [...words(lacking, 'without'), ...words(added, 'besides')].join(', ') || 'the same';
}

/** The server's own list against the page's. */
async function sameLists({ expert, annotations, check }, when) {
  const page = await settledIds(expert);
  const server = (await annotations.list({})).annotations.map(({ id }) => id);
  const words = difference(server, page);
  check(`the page lists what the server has, ${when}`, words === 'the same', words);
  return server;
}

/** The server goes away and comes back: the page says so, and comes back by itself. */
async function restart(context, start) {
  const { expert, check } = context;
  const before = await sameLists(context, 'before');
  context.truth.close();
  const stopMs = await context.server.stop();
  check('server stops on SIGTERM within 2 s', stopMs < 2000, `${stopMs.toFixed(0)} ms`);
  await expert.waitForStatus(/^reconnecting/, 10_000);
  await shot(context, 'reconnecting');
  context.server = await start();
  const begin = performance.now();
  await expert.page.locator('.app[data-link="live"]').waitFor({ timeout: 15_000 });
  const liveMs = performance.now() - begin;
  const { id } = await expert.look();
  await expert.page.waitForFunction(
    (old) => Number(document.querySelector('canvas.picture').dataset.frameId) !== old,
    id,
    { timeout: 15_000 },
  );
  const pictureMs = performance.now() - begin;
  await expert.waitForStatus(/^tracking/, 60_000);
  const after = await sameLists(context, 'after');
  check(
    'reconnects by itself',
    liveMs < 5000,
    `live ${liveMs.toFixed(0)} ms, moving picture ${pictureMs.toFixed(0)} ms after the server was back`,
  );
  const words = difference(before, after);
  check('annotations are back', words === 'the same', `${before.length} before, ${words} after`);
}
