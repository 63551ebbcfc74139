// The place as surfaces on the page: seen, held against the simulator's depth, clicked, put away, and there again
// after a reload. With --shots DIR pictures from five viewpoints, to be looked at.
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService } from '../../src/gen/saccade/v1/annotation_pb.js';
import { SessionService, Topic } from '../../src/gen/saccade/v1/session_pb.js';
import { atOutline } from './clicked.mjs';
import { Expert } from './expert.mjs';
import { quantile } from './laser.mjs';
import { inCamera, length, minus, project, rotate } from './optics.mjs';
import { renderDepths, startServer } from './server.mjs';

const LEAST_TRIANGLES = 8000;
const PRESSES = 60;
const BORDER_PX = 12; // of the simulator's picture
const LEAST_COVERED = 0.5; // of that picture
const MEDIAN_SHARE = 0.01; // of the depth
const CLICK_SHARE = 0.02;
const CLICKS = 3;
const SAME_M = 1e-4;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runSurfaces({ server: binary, evaluator, chromium, seed, shots, folder }) {
  if (shots) mkdirSync(shots, { recursive: true });
  const source = `sim:desk?seed=${seed}&fps=10`;
  const server = await startServer(binary, [
    ...['--source', source, '--mount', 'sim', '--data-dir', join(folder, 'surfaces-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots, poses: new Map() };
  context.depths = (id) => renderDepths(evaluator, source, id, join(folder, 'depths'));
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  const stop = new AbortController();
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.annotations = createClient(AnnotationService, transport);
    const session = createClient(SessionService, transport);
    const joined = await session.join({ displayName: 'test' });
    context.camera = joined.intrinsics;
    const heard = listen(context, session, joined.sessionId, stop.signal);
    heard.catch(() => undefined); // said where it is waited for
    context.expert = await Expert.open(chromium, server.http, {
      viewport: { width: 1000, height: 640 },
      look: '', // as whoever comes for the first time
    });
    const { expert } = context;
    await expert.waitForStatus(/^tracking/, 120_000);
    await expert.page.locator('canvas.map[data-eye]').waitFor();
    await appear(context);
    const places = await heldAgainstTruth(context);
    await clicked(context, places);
    await viewpoints(context);
    await putAway(context);
    await reloaded(context);
    stop.abort();
    await heard;
    context.check('page errors', expert.errors.length === 0, expert.errors.join('; ') || 'none');
  } finally {
    stop.abort();
    await context.expert?.close();
    await server.stop();
  }
  return context.failures;
}

/** Where the tracker has the camera, frame by frame. */
async function listen({ poses }, session, sessionId, signal) {
  try {
    const request = { sessionId, topics: [Topic.POSE], window: 256 };
    for await (const { sequence, event } of session.subscribe(request, { signal })) {
      if (sequence % 16n === 0n)
        session.acknowledge({ sessionId, sequence }).catch(() => undefined);
      const { frameId, worldFromCamera } = event.case === 'pose' ? event.value : {};
      const { rotation: q, translationM: t } = worldFromCamera ?? {};
      if (!q || !t) continue;
      const pose = { rotation_xyzw: [q.x, q.y, q.z, q.w], translation_m: [t.x, t.y, t.z] };
      poses.set(Number(frameId), pose);
    }
  } catch (error) {
    if (!signal.aborted) throw error;
  }
}

const chooser = ({ expert }, name) =>
  expert.page.locator(`.map-controls select[data-control=${name}]`);

const triangles = async ({ expert }) =>
  Number(await expert.page.locator('canvas.map').getAttribute('data-surfaces'));

async function whenTriangles(context, enough, withinMs) {
  const begin = Date.now();
  let count = 0;
  do {
    count = await triangles(context);
    if (enough(count)) return { count, ms: Date.now() - begin };
    await sleep(200);
  } while (Date.now() - begin < withinMs);
  return { count, ms: Infinity };
}

async function appear(context) {
  const { expert, check } = context;
  const note = expert.page.locator('.map3d .pane-note');
  const words = await note.innerText();
  const there = (await triangles(context)) > 0; // a slow page has them at once
  const first = await whenTriangles(context, (count) => count > 0, 60_000);
  check(
    'until there are surfaces, words say when',
    there || /surfaces appear where the camera has moved sideways/.test(words),
    there ? 'they were there first' : words,
  );
  const all = await whenTriangles(context, (count) => count >= LEAST_TRIANGLES, 60_000);
  check('surfaces appear', all.ms < Infinity, `${all.count} triangles, first after ${first.ms} ms`);
}

/** Once the map is drawn from there, and all is still. */
const drawnFrom = ({ expert }, view) =>
  expert.page.locator(`canvas.map[data-from="${view}"]`).waitFor({ timeout: 60_000 });

/** Stands where the wearer stood at one frame; its id and pose. */
async function standStill(context) {
  const { expert, poses } = context;
  await chooser(context, 'stand').selectOption('wearer');
  await drawnFrom(context, 'wearer');
  await expert.page.locator('.map3d').focus();
  await expert.press('ArrowLeft'); // by hand: the eye walks on from there
  await expert.press('ArrowRight');
  await drawnFrom(context, 'walk');
  const { pose } = await expert.mapView();
  let best;
  for (const [id, each] of poses) {
    const away = length(minus(each.translation_m, pose.translation_m));
    if (!best || away < best.away) best = { id, away, pose: each };
  }
  if (!best || best.away > SAME_M) throw new Error(`the eye is at no frame's: ${best?.away} m`);
  return best;
}

/** Presses all over the map; what the page found there, and what truly is. */
async function heldAgainstTruth(context) {
  const { expert, check, camera } = context;
  const { id, pose } = await standStill(context);
  const depths = await context.depths(id);
  const view = await expert.mapView();
  const found = [];
  let seen = 0;
  for (const [u, v] of spread(PRESSES)) {
    const at = [view.left + u * view.width, view.top + v * view.height];
    const way = rotate(view.pose.rotation_xyzw, [
      (u * view.width - view.width / 2) / view.focal,
      (v * view.height - view.height / 2) / view.focal,
      1,
    ]);
    const ahead = project(
      camera,
      inCamera(
        pose,
        way.map((x, i) => x + pose.translation_m[i]),
      ),
    );
    if (!inPicture(camera, ahead) || !(await expert.isOver('.map3d', at))) continue;
    const depth = depths.at(ahead);
    if (!(depth > 0)) continue;
    ++seen;
    await expert.click(at);
    const [, , how, ...point] = (
      await expert.page.locator('.map3d').getAttribute('data-pressed')
    ).split('|');
    if (how !== 'surface') continue;
    const inFrame = inCamera(pose, point.map(Number));
    found.push({ at, ahead, error: Math.abs(inFrame[2] - depth) / depth });
  }
  const errors = found.map(({ error }) => error);
  const covered = found.length / seen;
  check(
    'most of what the wearer sees is surface',
    seen > 15 && covered > LEAST_COVERED,
    `${(100 * covered).toFixed(0)} % of ${seen} places, ${await triangles(context)} triangles`,
  );
  check(
    "the mesh lies where the simulator's depth is",
    quantile(errors, 0.5) < MEDIAN_SHARE,
    `median ${percent(quantile(errors, 0.5))}, 90 % below ${percent(quantile(errors, 0.9))} of depth`,
  );
  return { id, pose, depths, found };
}

const percent = (share) => `${(100 * share).toFixed(2)} %`;

const inPicture = ({ widthPx, heightPx }, pixel) =>
  pixel !== undefined &&
  pixel[0] > BORDER_PX &&
  pixel[1] > BORDER_PX &&
  pixel[0] < widthPx - BORDER_PX &&
  pixel[1] < heightPx - BORDER_PX;

/** Evenly all over, in no order (Halton). */
function spread(count) {
  const at = (index, base) => {
    let [share, sum] = [1, 0];
    for (let i = index; i > 0; i = Math.floor(i / base)) sum += (share /= base) * (i % base);
    return sum;
  };
  return Array.from({ length: count }, (_, i) => [at(i + 1, 2), at(i + 1, 3)]);
}

/** Marks on surfaces in the map are where those surfaces are; on an outline a click may mean either side. */
async function clicked(context, { pose, depths, found }) {
  const { expert, check, annotations, camera } = context;
  const inside = found.filter(({ ahead }) => !atOutline(depths, ahead));
  const errors = [];
  const refusals = [];
  for (const { at } of inside.slice(0, CLICKS)) {
    const before = await expert.annotationIds();
    await expert.press('c');
    await expert.click(at);
    const { id, refused } = await expert.newAnnotation(before, 20_000);
    await expert.press('v');
    const mark = (await annotations.list({})).annotations.find((each) => each.id === id);
    if (!mark) {
      refusals.push(refused);
      continue;
    }
    const { x, y, z } = mark.anchor.pointInWorldM;
    const inFrame = inCamera(pose, [x, y, z]);
    const depth = depths.at(project(camera, inFrame));
    errors.push(Math.abs(inFrame[2] - depth) / depth);
  }
  check(
    'a click on a surface in the map lands on it',
    errors.length > 1 && quantile(errors, 0.5) < CLICK_SHARE,
    [...errors.map(percent), ...refusals].join(', '),
  );
}

/** Everywhere one can look from: chosen by list and by key, left by hand. */
async function viewpoints(context) {
  const { expert, check, shots } = context;
  const { page } = expert;
  const shot = async (name) => {
    if (shots) await page.screenshot({ path: join(shots, `surfaces-${name}.png`) });
  };
  const stand = chooser(context, 'stand');
  const eyes = {};
  for (const view of ['orbit', 'above', 'wearer', 'walk']) {
    await stand.selectOption(view);
    await drawnFrom(context, view);
    await shot(view);
    eyes[view] = (await expert.mapView()).pose;
  }
  const before = eyes.walk.translation_m;
  await page.keyboard.down('w');
  for (let tries = 0; tries < 100; ++tries, await sleep(100)) {
    const { pose } = await expert.mapView();
    if (length(minus(pose.translation_m, before)) > 0.3) break;
  }
  await page.keyboard.up('w');
  await drawnFrom(context, 'walk');
  await shot('close-up');
  const after = (await expert.mapView()).pose.translation_m;
  const [walked, rose] = [length(minus(after, before)), Math.abs(after[1] - before[1])];
  await expert.press('Escape');
  await drawnFrom(context, 'orbit');
  const left = await stand.inputValue();
  await expert.press('6');
  await drawnFrom(context, 'walk');
  const next = await stand.inputValue();
  await expert.press('Escape');
  await drawnFrom(context, 'orbit');
  check(
    'one walks in it, at one height; Escape and 6 choose as the list does',
    walked > 0.02 && rose < 1e-6 && left === 'orbit' && next === 'walk',
    `walked ${walked.toFixed(2)} m, then ${left}, ${next}`,
  );
  const down = rotate(eyes.above.rotation_xyzw, [0, 0, 1]);
  check('from above one looks down', down[1] > 0.99, down.map((x) => x.toFixed(2)).join(' '));
}

async function putAway(context) {
  const { check, expert } = context;
  const show = chooser(context, 'show');
  const begin = await show.inputValue();
  await show.selectOption('dots');
  const none = await whenTriangles(context, (count) => count === 0, 15_000);
  await expert.press('5');
  const back = await whenTriangles(context, (count) => count > 0, 15_000);
  await expert.press('5');
  let both = '';
  for (let tries = 0; tries < 100 && both !== 'both'; ++tries, await sleep(100)) {
    both = await show.inputValue(); // it says so with the next frame
  }
  check(
    'surfaces go and come back',
    begin === 'surfaces' && none.ms < Infinity && back.ms < Infinity && both === 'both',
    `${begin}, none after ${none.ms} ms, ${back.count} again after ${back.ms} ms, ${both}`,
  );
}

async function reloaded(context) {
  const { expert, check } = context;
  const before = await triangles(context);
  await expert.page.reload();
  await expert.page.locator('canvas.map[data-eye]').waitFor({ timeout: 60_000 });
  const again = await whenTriangles(context, (count) => count > 0.8 * before, 30_000);
  const look = await chooser(context, 'show').inputValue();
  check(
    'who comes late has it all, and sees it as before',
    again.ms < Infinity && look === 'both',
    `${again.count} of ${before} triangles ${again.ms} ms after the map, ${look}`,
  );
}
