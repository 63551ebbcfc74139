// An expert turns the (simulated) head from the page: the real server, the real controller, and the
// simulator's truth about where the camera really looks.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Expert } from './expert.mjs';
import { inCamera, inWorld, length, minus, project, times, unproject } from './optics.mjs';
import { median } from './pictures.mjs';
import { startServer, Truth } from './server.mjs';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { GazeService } from '../../src/gen/saccade/v1/gaze_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';

const LIMIT_DEG = 2;
const MAPPED_M = 0.05; // in the map one can only click what it shows
const BORDER_PX = 60; // the click is well inside
const HEARTBEAT_S = 5; // a second page that loads can keep two cores busy for longer than 2 s
const HOLD_S = 2; // over which holding is judged: the wearer sways, a single frame says little

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runGaze({ server: binary, chromium, seed, shots, folder }) {
  const truthFile = join(folder, 'gaze-truth.jsonl');
  // Two pages, simulator and tracker share two cores with a software GPU: the server waits longer for
  // a heartbeat than the 500 ms it does by default.
  const config = join(folder, 'gaze.toml');
  writeFileSync(config, `[gaze]\nheartbeat_s = ${HEARTBEAT_S}.0\n`);
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand`, '--mount', 'sim', '--config', config],
    ...['--sim-truth', truthFile, '--data-dir', join(folder, 'gaze-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.gaze = createClient(GazeService, transport);
    context.session = createClient(SessionService, transport);
    const joined = await context.session.join({ displayName: 'test' });
    context.camera = joined.intrinsics;
    context.map = createClient(MapService, transport);
    context.truth = new Truth(truthFile);
    context.ann = await Expert.open(chromium, `${server.http}/?name=Ann`);
    await context.ann.waitForStatus(/^tracking/, 60_000);
    await context.ann.page.locator('.app[data-first-picture-ms]').waitFor();
    await turnAndHold(context);
    await wearerTakesOver(context);
    await handsChange(context, `${server.http}/?name=Bob`);
    const { errors } = context.ann;
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    await context.ann?.close();
    await server.stop();
    context.truth?.close();
  }
  return context.failures;
}

/** What the gaze panel says. */
const panelOf = (page) =>
  page.evaluate(() => {
    const element = document.querySelector('section.gaze');
    const read = (selector) => element.querySelector(selector).textContent;
    const { mode, arrived } = element.dataset;
    const texts = { doing: read('.doing'), steer: read('.steer'), why: read('.why') };
    const notice = document.querySelector('.handover').textContent;
    return { mode, arrived: arrived === 'true', error: read('.error'), notice, ...texts };
  });

/** Waits until the panel is as wanted; what it said last, and whether that was it. */
async function panelWhen(page, wanted, timeoutMs) {
  const end = Date.now() + timeoutMs;
  for (;;) {
    const panel = await panelOf(page);
    const ok = wanted(panel);
    if (ok || Date.now() > end) return { ok, panel };
    await sleep(40);
  }
}

async function shot({ shots }, page, name) {
  if (shots) await page.screenshot({ path: join(shots, `${name}.png`) });
}

/** Clicks what is farthest from the middle; then again in the map, on another object. */
async function turnAndHold(context) {
  const { ann, check } = context;
  await ann.press('g');
  for (const pane of ['video', 'map']) {
    await ann.enlarge(pane);
    const object = pane === 'video' ? await clickInVideo(context) : await clickInMap(context);
    if (!object) throw new Error(`nothing to click in the ${pane}`);
    const begin = performance.now();
    const turning = await panelWhen(ann.page, ({ mode }) => mode === 'saccade', 2000);
    await sleep(350);
    await shot(context, ann.page, `gaze-${pane}-saccade`);
    const holding = await panelWhen(
      ann.page,
      ({ mode, arrived }) => mode === 'fixate' && arrived,
      8000,
    );
    const seconds = (performance.now() - begin) / 1000;
    await sleep(500);
    const { error, doing } = (await panelWhen(ann.page, ({ arrived }) => arrived, 3000)).panel;
    const truth = await medianError(context, object);
    await shot(context, ann.page, `gaze-${pane}-hold`);
    check(
      `a click in the ${pane} turns the camera, which then holds within ${LIMIT_DEG} deg`,
      turning.ok && holding.ok && parseFloat(error) < LIMIT_DEG && truth < LIMIT_DEG,
      `${object.name}: "${doing}" after ${seconds.toFixed(1)} s, shown error ${error}, ` +
        `true error ${truth.toFixed(2)} deg`,
    );
  }
}

/** The middle one of the true errors of the frames that the page shows in these seconds [deg]. */
async function medianError(context, object) {
  const ids = new Set();
  for (const end = Date.now() + 1000 * HOLD_S; Date.now() < end; await sleep(40)) {
    ids.add((await context.ann.look()).id);
  }
  return median([...ids].map((id) => trueError(context, id, object)));
}

/** The true angle between the optic axis of a frame and an object. */
function trueError({ truth }, id, { point_in_world_m: point }) {
  const at = inCamera(truth.frame(id).world_from_camera, point);
  return (Math.acos(times(at, 1 / length(at))[2]) * 180) / Math.PI;
}

async function clickInVideo({ ann, truth, camera }) {
  const { id, left, top, scale, width, height } = await ann.look();
  const away = ({ pixel: [u, v] }) => Math.hypot(u - width / 2, v - height / 2);
  const seen = truth
    .frame(id)
    .objects.filter(({ visible, pixel }) => visible && pixel)
    .filter(
      ({ pixel: [u, v] }) =>
        u > BORDER_PX && u < width - BORDER_PX && v > BORDER_PX && v < height - BORDER_PX,
    )
    .sort((a, b) => away(b) - away(a));
  for (const object of seen) {
    const at = [left + (object.pixel[0] + 0.5) * scale, top + (object.pixel[1] + 0.5) * scale];
    if (!(await ann.isOver('.video', at))) continue;
    await ann.click(at);
    return clickedAt(ann, truth, camera, object);
  }
  return undefined;
}

/** What lay under the click in the frame that was on the screen by then, at its object's depth. */
async function clickedAt(ann, truth, camera, { name, point_in_world_m: point }) {
  const { id, pixel } = await ann.pressed();
  const pose = truth.frame(id).world_from_camera;
  const clicked = unproject(camera, pixel, inCamera(pose, point)[2]);
  return { name, point_in_world_m: inWorld(pose, clicked) };
}

/** The object that the camera has to turn farthest for, of those that the map shows. */
async function clickInMap(context) {
  const { ann, truth } = context;
  await ann.press('h');
  await sleep(400);
  const view = await ann.mapView();
  const eye = { fxPx: view.focal, fyPx: view.focal, cxPx: view.width / 2, cyPx: view.height / 2 };
  const { id } = await ann.look();
  const { map: now } = await context.map.get({});
  const mapped = ({ point_in_world_m: at }) =>
    now.upserted.some(({ depthKnown, pointInWorldM: { x, y, z } }) => {
      return depthKnown && length(minus([x, y, z], at)) < MAPPED_M;
    });
  const objects = truth
    .frame(id)
    .objects.filter((object) => object.visible && mapped(object))
    .map((object) => ({ object, away: trueError(context, id, object) }))
    .sort((a, b) => b.away - a.away);
  for (const { object } of objects) {
    const pixel = project({ ...eye, distortion: [] }, inCamera(view.pose, object.point_in_world_m));
    if (!pixel) continue;
    const at = [view.left + pixel[0], view.top + pixel[1]];
    if (!(await ann.isOver('.map3d', at))) continue;
    await ann.click(at);
    return object;
  }
  return undefined;
}

/** The wearer takes the head from its pilot and gives it back. */
async function wearerTakesOver({ ann, session, gaze, check }) {
  const { sessionId } = await session.join({ displayName: 'Wim', role: Role.WEARER });
  await gaze.override({ sessionId, enabled: true });
  const queue = 'Wim pilots · you are 1st in the queue';
  const waits = await panelWhen(ann.page, ({ steer }) => steer === queue, 5000);
  await gaze.override({ sessionId, enabled: false });
  const back = await panelWhen(ann.page, ({ steer }) => steer === 'you pilot', 5000);
  await sleep(1000 * HEARTBEAT_S + 300); // longer than the server waits for a heartbeat
  const { steer } = await panelOf(ann.page);
  check(
    'the wearer takes over; given back, the pilot has it again and keeps it',
    waits.ok && back.ok && steer === 'you pilot',
    `"${waits.panel.steer}", then "${steer}"`,
  );
}

/** Another expert sees who pilots, waits, and has the head; it stops; and rests when he is gone. */
async function handsChange(context, url) {
  const { ann, check } = context;
  await ann.enlarge('video'); // a small map costs the software GPU less, and so does a small page
  const bob = await ann.context.newPage();
  await bob.setViewportSize({ width: 700, height: 500 });
  await bob.goto(url);
  const seen = await panelWhen(bob, ({ steer }) => steer === 'Ann pilots', 30_000);
  check('a second page sees who pilots', seen.ok, `"${seen.panel.steer}"`);
  await bob.keyboard.press('q');
  const waits = await panelWhen(bob, ({ steer }) => steer.includes('1st in the queue'), 10_000);
  const told = await panelWhen(ann.page, ({ steer }) => steer === 'you pilot · Bob waits', 10_000);
  check('he waits, and the pilot sees it', waits.ok && told.ok, `"${told.panel.steer}"`);

  await ann.press('x');
  const stopped = await panelWhen(ann.page, ({ mode }) => mode === 'stopped', 5000);
  check('stop stops', stopped.ok, `"${stopped.panel.doing}"`);
  await ann.press('q');
  const his = await panelWhen(bob, ({ steer }) => steer === 'you pilot', 10_000);
  const notice = await panelWhen(ann.page, (panel) => panel.notice.includes('Bob pilots'), 5000);
  await shot(context, ann.page, 'gaze-handover');
  check(
    'released, it is his turn, and everybody is told',
    his.ok && notice.ok,
    notice.panel.notice,
  );
  await bob.close();
  const parked = await panelWhen(ann.page, ({ mode }) => mode === 'parked', 10_000);
  check('with his page gone the head parks', parked.ok, `"${parked.panel.doing}"`);
}
