// Many clicks through the page while the wearer moves and the network is late: in the live picture, in a frozen
// one and in the map; how far each mark is from what was clicked, in pixels of the view and in millimetres.
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService } from '../../src/gen/saccade/v1/annotation_pb.js';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { aimInMap, aimInVideo, candidates } from './checks.mjs';
import { delayed } from './delay.mjs';
import { Expert } from './expert.mjs';
import { quantile } from './laser.mjs';
import { inCamera, length, minus, project } from './optics.mjs';
import { renderDepths, startServer, Truth } from './server.mjs';

const LATE_MS = 400; // each way: the picture is that old, and the answer comes after twice as long
const COUNT = 200;
const SETTLED_MS = 1000; // after the answer: what the tracker has made of it
const PER_STILL = 8;
const BAR = { video: 0.05, frozen: 0.05, map: 0.05 }; // of the depth, in the median

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runClicks({
  server: binary,
  evaluator,
  chromium,
  seed,
  folder,
  count = COUNT,
  only,
}) {
  const source = `sim:desk?seed=${seed}&motion=sway&fps=15`;
  const truthFile = join(folder, 'clicks.jsonl');
  const server = await startServer(binary, [
    ...['--source', source, '--sim-truth', truthFile],
    ...['--data-dir', join(folder, 'clicks-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, truth: new Truth(truthFile) };
  context.depths = (id) => renderDepths(evaluator, source, id, join(folder, 'depths'));
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  const late = await delayed(server.address, LATE_MS);
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.annotations = createClient(AnnotationService, transport);
    context.map = createClient(MapService, transport);
    const joined = await createClient(SessionService, transport).join({
      ...{ displayName: 'tidy', role: Role.WEARER },
    });
    context.owner = joined.sessionId;
    context.camera = joined.intrinsics;
    context.expert = await Expert.open(chromium, late.http, {
      viewport: { width: 1000, height: 640 },
      prefix: ['nice', '-n', '5'],
    });
    await context.expert.waitForStatus(/^tracking/, 60_000);
    await context.expert.page.locator('canvas.map[data-eye]').waitFor();
    const each = Math.ceil(Number(count) / 3);
    for (const [pane, run] of Object.entries({ video, frozen, map })) {
      if (!only || only.split(',').includes(pane)) await report(context, pane, each, run);
    }
    const { errors } = context.expert;
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    await context.expert?.close();
    late.close();
    await server.stop();
  }
  return context.failures;
}

async function report(context, pane, wanted, run) {
  const { check, expert } = context;
  const found = [];
  const lost = { refused: 0, unanswered: 0 };
  const hz = [];
  const end = Date.now() + 20_000 + wanted * 30_000;
  await run(context, {
    enough: () => found.length >= wanted || Date.now() > end,
    keep: (hit) => found.push(hit),
    lost,
    hz,
  });
  await expert.press('v');
  const of = (key) => found.map((hit) => hit[key]);
  const pair = (key, digits) =>
    found.length > 0
      ? `${quantile(of(key), 0.5).toFixed(digits)} / ${quantile(of(key), 0.95).toFixed(digits)}`
      : '-';
  check(
    `${found.length} clicks in the ${pane} view, ${LATE_MS} ms late each way`,
    found.length >= 0.9 * wanted && quantile(of('share'), 0.5) < BAR[pane],
    `p50 / p95: ${pair('px', 1)} px, ${pair('mm', 1)} mm, ${pair('percent', 2)} % of depth; answered after ` +
      `${pair('answerMs', 0)} ms; refused ${lost.refused}, unanswered ${lost.unanswered}; ` +
      `tracked ${quantile(hz.concat(0), 0.5)} pictures a second`,
  );
}

/** Waits for the mark of a click, measures it and takes it away again. */
async function outcome(context, session, before, clickedMs, where) {
  const { expert, annotations, owner } = context;
  const { id, refused } = await expert.newAnnotation(before, 10_000);
  if (!id) {
    ++session.lost[refused === 'no answer' ? 'unanswered' : 'refused'];
    return;
  }
  const answerMs = Date.now() - clickedMs;
  await sleep(SETTLED_MS);
  const mark = (await annotations.list({})).annotations.find((each) => each.id === id);
  const hit = await where(mark?.anchor?.pointInWorldM);
  session.hz.push(await expert.trackedHz());
  await annotations.delete({ sessionId: owner, id }).catch(() => undefined);
  if (!hit) return; // the wearer had moved on: no object was clicked
  session.keep({ ...hit, answerMs, percent: 100 * hit.share });
}

/** `view`: projects a point to pixels of the clicked view; `pixel` was clicked there. */
function errorOf(anchor, { point, depth }, pixel, view) {
  if (!anchor) return { mm: Infinity, px: Infinity, share: Infinity };
  const at = [anchor.x, anchor.y, anchor.z];
  const away = length(minus(at, point));
  const seen = view(at);
  return {
    mm: 1000 * away,
    share: away / depth,
    px: seen ? length(minus(seen, pixel)) : Infinity,
  };
}

async function video(context, session) {
  const { expert, truth, camera } = context;
  await expert.enlarge('video');
  await expert.press('c');
  const used = new Map();
  while (!session.enough()) {
    const before = await expert.annotationIds();
    const click = await aimInVideo(context, used);
    const clickedMs = Date.now();
    if (!click) {
      await sleep(100);
      continue;
    }
    used.set(click.name, (used.get(click.name) ?? 0) + 1);
    const { id: frameId, pixel } = await expert.pressed();
    const hit = await click.where();
    await outcome(context, session, before, clickedMs, (anchor) => {
      if (!hit) return undefined;
      const { world_from_camera: pose } = truth.frame(frameId);
      return errorOf(anchor, hit, pixel, (point) => project(camera, inCamera(pose, point)));
    });
  }
}

async function frozen(context, session) {
  const { expert, truth, camera } = context;
  await expert.enlarge('video');
  const still = expert.page.locator('canvas.still');
  while (!session.enough()) {
    await expert.press('v');
    await expert.press('p');
    await still.waitFor({ timeout: 10_000 });
    const frame = truth.frame(Number(await still.getAttribute('data-frame-id')));
    await expert.press('c');
    const { left, top, scale, width, height } = await expert.look();
    let count = 0;
    for (const { point_in_world_m: point, pixel } of candidates(frame, new Map())) {
      if (session.enough() || count === PER_STILL) break;
      const [u, v] = pixel;
      if (u < 30 || v < 30 || u > width - 30 || v > height - 30) continue;
      const at = [left + (u + 0.5) * scale, top + (v + 0.5) * scale];
      if (!(await expert.isOver('.video', at))) continue;
      ++count;
      const before = await expert.annotationIds();
      const clickedMs = Date.now();
      await expert.click(at);
      const depth = inCamera(frame.world_from_camera, point)[2];
      await outcome(context, session, before, clickedMs, (anchor) =>
        errorOf(anchor, { point, depth }, pixel, (each) =>
          project(camera, inCamera(frame.world_from_camera, each)),
        ),
      );
    }
    await expert.press('v');
    await expert.press('p');
    await sleep(1500);
  }
}

async function map(context, session) {
  const { expert } = context;
  await expert.enlarge('map');
  await expert.press('c');
  const used = new Map();
  while (!session.enough()) {
    const before = await expert.annotationIds();
    const click = await aimInMap(context, used);
    const clickedMs = Date.now();
    if (!click) {
      await sleep(100);
      continue;
    }
    used.set(click.name, (used.get(click.name) ?? 0) + 1);
    const { pose, focal, left, top, width, height } = await expert.mapView();
    const eye = { fxPx: focal, fyPx: focal, cxPx: width / 2, cyPx: height / 2, distortion: [] };
    const pixel = minus(click.at, [left, top]);
    await outcome(context, session, before, clickedMs, async (anchor) =>
      errorOf(anchor, await click.where(), pixel, (point) => project(eye, inCamera(pose, point))),
    );
  }
}
