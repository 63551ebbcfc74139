// Dots of measured features, as pixels of the page, while the wearer turns: each lies where that very
// frame measured it, and where the true pose of that frame puts the true point. The true points come
// from many frames' measurements and the simulator's true poses; nothing of the tracker's estimate is in it.
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { SessionService, Topic } from '../../src/gen/saccade/v1/session_pb.js';
import { Expert } from './expert.mjs';
import { inCamera, length, minus, plus, project, rotate, times, unproject } from './optics.mjs';
import { blobsOf, decodePng, median, pixelsOf } from './pictures.mjs';
import { startServer, Truth } from './server.mjs';

const MEASURED = [0xff, 0x5a, 0x4d];
const SAMPLES = 24;
const LIMIT_PX = 2;
const OLD = 10; // frames: where the dots were that long ago, to see that the test could fail
const MIN_SIGHTINGS = 8;
const LIMIT_LOST_S = 120;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runDots({ server: binary, chromium, seed, shots, folder }) {
  const truthFile = join(folder, 'dots-truth.jsonl');
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=twist`, '--speed', 'max'],
    ...['--sim-truth', truthFile, '--data-dir', join(folder, 'dots-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots, frames: new Map() };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  const stop = new AbortController();
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.session = createClient(SessionService, transport);
    const joined = await context.session.join({ displayName: 'test' });
    context.camera = joined.intrinsics;
    context.truth = new Truth(truthFile);
    const heard = listen(context, joined.sessionId, stop.signal);
    context.expert = await Expert.open(chromium, server.http);
    await context.expert.waitForStatus(/^tracking/, 60_000);
    await context.expert.enlarge('video');
    const samples = await sample(context);
    await stillKeepsItsOwn(context);
    stop.abort();
    await heard;
    judge(context, samples);
    const { errors } = context.expert;
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    stop.abort();
    await context.expert?.close();
    await server.stop();
    context.truth?.close();
  }
  return context.failures;
}

/** What every frame measured, as another subscriber is told. */
async function listen({ session, frames }, sessionId, signal) {
  const topics = [Topic.VIDEO, Topic.MAP];
  try {
    for await (const { sequence, event } of session.subscribe(
      { sessionId, topics, window: 256 },
      { signal },
    )) {
      if (sequence % 16n === 0n)
        session.acknowledge({ sessionId, sequence }).catch(() => undefined);
      if (event.case !== 'accessUnit') continue;
      const { measuredIds = [], measuredPx16 = [] } = event.value.features ?? {};
      const seen = measuredIds.map((id, i) => ({
        id: Number(id),
        pixel: [measuredPx16[2 * i] / 16, measuredPx16[2 * i + 1] / 16],
      }));
      frames.set(Number(event.value.frameId), seen);
    }
  } catch (error) {
    if (!signal.aborted) throw error;
  }
}

/** Dots on the page, with the frame they are drawn on, over some seconds of turning. */
async function sample({ expert, shots, truth }) {
  const samples = [];
  for (const end = Date.now() + 1000 * LIMIT_LOST_S; samples.length < SAMPLES; ) {
    if (Date.now() > end) break;
    const drawn = await expert.marks();
    await sleep(150);
    if (samples.at(-1)?.id === drawn.id || !truth.frame(drawn.id)) continue;
    const discs = discsOf(drawn);
    if (discs.length < 5) continue; // tracking is being found again
    if (shots && samples.length === SAMPLES / 2) {
      await expert.page.screenshot({ path: join(shots, 'dots.png') });
    }
    samples.push({ id: drawn.id, discs });
  }
  return samples;
}

/** Middles of the red discs that touch no other, in pixels of the picture. */
function discsOf({ png, ratio, left, top, scale }) {
  const blobs = blobsOf(pixelsOf(decodePng(png), MEASURED, 50));
  const usual = median(blobs.map(({ size }) => size));
  return blobs
    .filter(({ size, width, height }) => {
      return size > 0.75 * usual && size < 1.3 * usual && Math.abs(width - height) <= 1;
    })
    .map(({ middle: [x, y] }) => [
      ((x + 0.5) / ratio - left) / scale - 0.5,
      ((y + 0.5) / ratio - top) / scale - 0.5,
    ]);
}

const near = (points, at) => Math.min(...points.map((point) => length(minus(point, at))), Infinity);

function judge({ check, frames, truth, camera }, samples) {
  const points = truePoints({ frames, truth, camera });
  const where = (id, pose) =>
    (frames.get(id) ?? [])
      .filter((seen) => points.has(seen.id))
      .map((seen) => project(camera, inCamera(pose, points.get(seen.id))))
      .filter(Boolean);
  const told = [];
  const true_ = [];
  const old = [];
  let measured = 0;
  for (const { id, discs } of samples) {
    const pose = truth.frame(id).world_from_camera;
    const before = truth.frame(Math.max(0, id - OLD)).world_from_camera;
    const own = (frames.get(id) ?? []).map(({ pixel }) => pixel);
    measured += own.length;
    const [now, then] = [where(id, pose), where(id, before)];
    for (const disc of discs) {
      told.push(near(own, disc));
      true_.push(near(now, disc));
      old.push(near(then, disc));
    }
  }
  const share = (errors) => errors.filter((error) => error <= LIMIT_PX).length / errors.length;
  const words = (errors) =>
    `${errors.filter((error) => error <= LIMIT_PX).length} of ${errors.length} within ${LIMIT_PX} px, ` +
    `median ${median(errors)?.toFixed(2)} px`;
  check(
    'the wearer turns: dots would be elsewhere a third of a second before',
    samples.length >= SAMPLES / 2 && share(old) < 0.5,
    `${samples.length} frames, ${turnedDeg(samples, truth).toFixed(0)} deg; ${words(old)}`,
  );
  check(
    'each disc is where its own frame measured it',
    told.length > 0.5 * measured && share(told) === 1,
    `${words(told)}; ${measured} measured in these frames`,
  );
  check(
    'discs are where the true pose puts the true points',
    share(true_) > 0.95,
    `${words(true_)}, ${points.size} points`,
  );
}

/** The largest angle between two of the frames. */
function turnedDeg(samples, truth) {
  const axes = samples.map(({ id }) =>
    rotate(truth.frame(id).world_from_camera.rotation_xyzw, [0, 0, 1]),
  );
  const cosines = axes.flatMap((a) => axes.map((b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2]));
  return (Math.acos(Math.max(-1, Math.min(...cosines))) * 180) / Math.PI;
}

/** Of each feature the point that the rays of its measurements, from the true poses, meet in. */
function truePoints({ frames, truth, camera }) {
  const rays = new Map();
  for (const [frame, seen] of frames) {
    const pose = truth.frame(frame)?.world_from_camera;
    if (!pose) continue;
    for (const { id, pixel } of seen) {
      const ray = rotate(pose.rotation_xyzw, unproject(camera, pixel, 1));
      const one = { pose, pixel, from: pose.translation_m, along: times(ray, 1 / length(ray)) };
      if (!rays.has(id)) rays.set(id, []);
      rays.get(id).push(one);
    }
  }
  const points = new Map();
  for (const [id, all] of rays) {
    let kept = all;
    for (let round = 0; round < 3 && kept.length >= MIN_SIGHTINGS; ++round) {
      const point = meet(kept);
      points.set(id, point);
      kept = all.filter(({ pose, pixel }) => {
        const at = project(camera, inCamera(pose, point));
        return at && length(minus(at, pixel)) < 3;
      });
    }
    // A feature that is no point of the room (an edge against what lies behind) has no true place.
    if (kept.length < 0.7 * all.length || kept.length < MIN_SIGHTINGS) points.delete(id);
  }
  return points;
}

/** The point with the least squared distance to all rays. */
function meet(rays) {
  const a = [
    [0, 0, 0],
    [0, 0, 0],
    [0, 0, 0],
  ];
  let b = [0, 0, 0];
  for (const { from, along } of rays) {
    const across = [0, 1, 2].map((r) =>
      [0, 1, 2].map((c) => (r === c ? 1 : 0) - along[r] * along[c]),
    );
    across.forEach((row, r) => row.forEach((value, c) => (a[r][c] += value)));
    b = plus(
      b,
      across.map((row) => row[0] * from[0] + row[1] * from[1] + row[2] * from[2]),
    );
  }
  const det = ([p, q, r]) =>
    p[0] * (q[1] * r[2] - q[2] * r[1]) -
    p[1] * (q[0] * r[2] - q[2] * r[0]) +
    p[2] * (q[0] * r[1] - q[1] * r[0]);
  return [0, 1, 2].map(
    (i) => det(a.map((row, r) => row.map((value, c) => (c === i ? b[r] : value)))) / det(a),
  );
}

/** A frozen picture keeps the dots of its own frame, whatever is measured after it. */
async function stillKeepsItsOwn({ expert, frames, check }) {
  await expert.press('p');
  await sleep(3000);
  const drawn = await expert.marks();
  const { id: live } = await expert.look();
  const discs = discsOf(drawn);
  await expert.press('p');
  const own = (frames.get(drawn.id) ?? []).map(({ pixel }) => pixel);
  const errors = discs.map((disc) => near(own, disc));
  check(
    'a frozen picture keeps the dots of its frame',
    live > drawn.id && discs.length > 0 && Math.max(...errors) <= LIMIT_PX,
    `frame ${drawn.id}, live at ${live}: ${discs.length} discs, worst ${Math.max(...errors).toFixed(2)} px`,
  );
}
