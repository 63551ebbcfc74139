// The shapes of docs/design/marks.md as the page paints them and as the server's overlay does, pixel by pixel in
// one frame: both against lines that are worked out here anew, and a pinned picture against the other's.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import pngjs from 'pngjs';
import {
  AnchorState,
  AnnotationService,
  AnnotationShape,
} from '../../src/gen/saccade/v1/annotation_pb.js';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { VideoView } from '../../src/gen/saccade/v1/video_pb.js';
import { Expert } from './expert.mjs';
import { inCamera, length, minus, plus, project, rotate, times } from './optics.mjs';
import { displacement } from './outline.mjs';
import { decodePng, pixelsOf } from './pictures.mjs';
import { startServer } from './server.mjs';

const SAME_PX = 1.5; // both are drawn to whole pixels, with smooth edges
const COLOUR_OFF = 70; // of 255: of a line 2 px wide over a picture
const SAMPLES = 6; // a side, of a pinned picture
const PICTURE_OFF = 40;
const SETTLED_MS = 4000;
const TRIES = 6;
const QUARTERS = [
  [200, 60, 60],
  [60, 200, 60],
  [60, 60, 200],
  [200, 200, 60],
];
const TURNED = { x: 0, y: Math.sin(0.3), z: 0, w: Math.cos(0.3) };

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const vector = ({ x, y, z }) => [x, y, z];

/** Each in a colour that is drawn nowhere else. */
const DRAFTS = {
  box: {
    ...{ shape: AnnotationShape.BOX, colorRgba: 0xff00ffff, at: [150, 170] },
    more: { extentM: { x: 0.1, y: 0.07, z: 0.05 }, worldFromMark: TURNED },
  },
  measure: {
    ...{ shape: AnnotationShape.MEASURE, colorRgba: 0x00ffffff, at: [270, 150], to: [400, 185] },
    more: { sizeM: 0.4 }, // ticks large enough to hold the line along itself
  },
  pin: {
    ...{ shape: AnnotationShape.PIN, colorRgba: 0xff8000ff, at: [520, 230] },
    more: { sizeM: 0.12 },
  },
  picture: {
    ...{ shape: AnnotationShape.PICTURE, colorRgba: 0x9000ffff, at: [170, 400] },
    more: { sizeM: 0.15 },
  },
  'check list': {
    ...{ shape: AnnotationShape.CHECK_LIST, colorRgba: 0x90ff00ff, at: [340, 420] },
    more: { sizeM: 0.12, text: 'service', checkItems: ['oil', 'lid'] },
  },
  ink: {
    ...{ shape: AnnotationShape.INK, colorRgba: 0xff0080ff, at: [420, 100] },
    more: {
      inkOffsetM: Array.from({ length: 30 }, (_, i) => ({
        ...{ x: 0.006 * i, y: 0.04 * Math.sin(i / 4), z: 0.002 * i },
      })),
    },
  },
};

export async function runShapes({ server: binary, chromium, seed, shots, folder }) {
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand&fps=10`],
    ...['--data-dir', join(folder, 'shapes-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.annotations = createClient(AnnotationService, transport);
    context.session = createClient(SessionService, transport);
    context.map = createClient(MapService, transport);
    const joined = await context.session.join({ displayName: 'test', role: Role.EXPERT });
    context.owner = joined.sessionId;
    context.expert = await Expert.open(chromium, server.http, {
      viewport: { width: 1000, height: 640 },
    });
    await context.expert.waitForStatus(/^tracking/, 60_000);
    await context.expert.enlarge('video');
    await place(context);
    await compare(context);
  } finally {
    await context.expert?.close();
    await server.stop();
  }
  return context.failures;
}

function quarters() {
  const image = new pngjs.PNG({ width: 160, height: 100 });
  for (let y = 0; y < 100; ++y) {
    for (let x = 0; x < 160; ++x) {
      image.data.set([...QUARTERS[(y < 50 ? 0 : 2) + (x < 80 ? 0 : 1)], 255], 4 * (160 * y + x));
    }
  }
  return new Uint8Array(pngjs.PNG.sync.write(image));
}

/** What sorts the features of the map by how near to a pixel they appear now. */
export async function featuresNear({ session, map }) {
  const view = viewOf(await session.getFrame({}));
  const features = (await map.get({})).map.upserted
    .filter(({ depthKnown }) => depthKnown)
    .map((feature) => ({ feature, pixel: pixelIn(view, vector(feature.pointInWorldM)) }))
    .filter(({ pixel }) => pixel);
  return (at) =>
    [...features].sort((a, b) => length(minus(a.pixel, at)) - length(minus(b.pixel, at)));
}

/** On features of the map near where they are wanted, as their place is known best; where one is not trusted, another. */
async function place(context) {
  const near = await featuresNear(context);
  for (const draft of Object.values(DRAFTS)) {
    for (const { feature } of near(draft.at).slice(0, TRIES)) {
      const end = draft.to && near(draft.to)[0].feature;
      if (await trusted(context, draft, feature, end)) break;
    }
  }
}

/** Creates it there; false, and nothing created, where the server does not come to trust its place. */
async function trusted({ annotations, owner }, { shape, colorRgba, more }, feature, end) {
  const on = ({ id }) => ({ target: { case: 'featureId', value: id } });
  const { annotation } = await annotations.create({
    ...{ requestId: globalThis.crypto.randomUUID(), sessionId: owner },
    draft: {
      ...{ shape, colorRgba, target: on(feature), endTarget: end && on(end), ...more },
      picture: shape === AnnotationShape.PICTURE ? quarters() : undefined,
    },
  });
  for (const until = Date.now() + SETTLED_MS; Date.now() < until; await sleep(300)) {
    const { annotations: all } = await annotations.list({});
    const mark = all.find(({ id }) => id === annotation.id);
    if (mark.anchor.state === AnchorState.TRACKING) return true;
  }
  await annotations.delete({ sessionId: owner, id: annotation.id });
  return false;
}

/** Until the page has drawn the pinned picture, whose bytes come after its place. */
async function ready(expert) {
  for (const end = Date.now() + SETTLED_MS * 5; Date.now() < end; await sleep(300)) {
    const image = decodePng((await expert.marks()).png);
    if (QUARTERS.every((rgb) => pixelsOf(image, rgb, PICTURE_OFF).length > 50)) return;
  }
}

/** The frozen frame as the page shows it and as the server draws it. */
async function compare(context) {
  const { expert, session, annotations, check, shots } = context;
  await expert.waitForStatus(/^tracking/, 60_000);
  await expert.page.locator('canvas.picture[data-frame-id]').waitFor();
  await expert.press('p');
  const still = expert.page.locator('canvas.still');
  await still.waitFor({ timeout: 10_000 });
  const frameId = Number(await still.getAttribute('data-frame-id'));
  await ready(expert);
  const [marks, augmented, { annotations: all }] = await Promise.all([
    expert.marks(),
    session.getFrame({ frameId: BigInt(frameId), view: VideoView.AUGMENTED }),
    annotations.list({}),
  ]);
  if (marks.id !== frameId) throw new Error(`marks of frame ${marks.id}, not ${frameId}`);
  const page = decodePng(marks.png);
  const server = decodePng(augmented.png);
  if (shots) {
    await expert.page.screenshot({ path: join(shots, 'shapes-page.png') });
    writeFileSync(join(shots, 'shapes-server.png'), augmented.png);
  }
  const toPicture = ([x, y]) => [
    ((x + 0.5) / marks.ratio - marks.left) / marks.scale - 0.5,
    ((y + 0.5) / marks.ratio - marks.top) / marks.scale - 0.5,
  ];
  const view = viewOf(augmented);
  for (const [name, { shape }] of Object.entries(DRAFTS)) {
    const mark = all.find((each) => each.shape === shape);
    if (!mark) {
      check(`${name}: the page’s pixels and the server’s`, false, 'no place was trusted');
      continue;
    }
    const wanted = linesOf(mark, view).flatMap((line) => along(line, view));
    const rgb = [24, 16, 8].map((shift) => (mark.colorRgba >>> shift) & 255);
    const byPage = displacement(wanted, pixelsOf(page, rgb, COLOUR_OFF).map(toPicture));
    const byServer = displacement(wanted, pixelsOf(server, rgb, COLOUR_OFF));
    const apart = byPage && byServer && length(minus(byPage, byServer));
    const words = (at) => (at ? `(${at.map((v) => v.toFixed(2)).join(', ')})` : 'not found');
    check(
      `${name}: the page’s pixels and the server’s`,
      apart < SAME_PX && length(byPage) < SAME_PX && length(byServer) < SAME_PX,
      `moved ${words(byPage)} and ${words(byServer)} px, ${apart?.toFixed(2) ?? '-'} px apart, ` +
        `${wanted.length} points; state ${AnchorState[mark.anchor.state]}`,
    );
  }
  filled(context, all, view, { page, server, marks });
}

function viewOf({ intrinsics, pose }) {
  const { rotation: q, translationM: t } = pose.worldFromCamera;
  return {
    intrinsics,
    pose: { rotation_xyzw: [q.x, q.y, q.z, q.w], translation_m: vector(t) },
  };
}

const pixelIn = ({ intrinsics, pose }, point) => project(intrinsics, inCamera(pose, point));

/** Points of a line in world, as dense as pixels. */
function along(line, view) {
  const points = [];
  for (let i = 1; i < line.length; ++i) {
    const [a, b] = [line[i - 1], line[i]];
    const steps = Math.ceil(2 * length(minus(pixelIn(view, b), pixelIn(view, a)))) + 1;
    for (let k = 0; k < steps; ++k) {
      points.push(pixelIn(view, plus(times(a, 1 - k / steps), times(b, k / steps))));
    }
  }
  return points;
}

const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const unit = (v) => times(v, 1 / length(v));

/** docs/design/marks.md, world y down. */
function linesOf(mark, view) {
  const p = vector(mark.anchor.pointInWorldM);
  const s = mark.sizeM;
  const from = (dx, dy, dz) => plus(p, [dx, dy, dz]);
  switch (mark.shape) {
    case AnnotationShape.BOX:
      return boxLines(p, vector(mark.extentM), mark.worldFromMark);
    case AnnotationShape.MEASURE:
      return measureLines(p, vector(mark.inkOffsetM[0]), s);
    case AnnotationShape.PIN: {
      const kite = (x, z) => [
        p,
        from(-0.25 * s * x, -0.7 * s, -0.25 * s * z),
        from(0, -s, 0),
        from(0.25 * s * x, -0.7 * s, 0.25 * s * z),
        p,
      ];
      return [kite(1, 0), kite(0, 1)];
    }
    case AnnotationShape.PICTURE: {
      const [a, b, c, d] = cornersOf(mark, view);
      return [[a, b, c, d, a]];
    }
    case AnnotationShape.CHECK_LIST:
      return [[p, from(0, -s, 0)]];
    case AnnotationShape.INK:
      return [mark.inkOffsetM.map((offset) => plus(p, vector(offset)))];
    default:
      throw new Error(`no lines for shape ${mark.shape}`);
  }
}

function boxLines(p, extent, { x, y, z, w }) {
  const corner = (i) =>
    plus(
      p,
      rotate(
        [x, y, z, w],
        extent.map((edge, axis) => (i & (1 << axis) ? edge : -edge) / 2),
      ),
    );
  const lines = [];
  for (let i = 0; i < 8; ++i) {
    for (const bit of [1, 2, 4]) if (!(i & bit)) lines.push([corner(i), corner(i | bit)]);
  }
  return lines;
}

function measureLines(p, offset, s) {
  const far = plus(p, offset);
  const half = times(unit(cross(offset, [0, 1, 0])), Math.min(0.2 * s, 0.25 * length(offset)));
  const tick = (end) => [minus(end, half), plus(end, half)];
  return [[p, far], tick(p), tick(far)];
}

/** From the lower left, as whoever looks sees it. */
function cornersOf(mark, { pose }) {
  const p = vector(mark.anchor.pointInWorldM);
  const [x, , z] = minus(p, pose.translation_m);
  const right = times(cross([0, 1, 0], unit([x, 0, z])), mark.sizeM / 2);
  const up = [0, (-mark.sizeM * mark.picture.height) / mark.picture.width, 0];
  return [minus(p, right), plus(p, right), plus(plus(p, right), up), plus(minus(p, right), up)];
}

/** What the pinned picture shows inside its outline, sampled, on both. */
function filled({ check }, all, view, { page, server, marks }) {
  const mark = all.find(({ shape }) => shape === AnnotationShape.PICTURE);
  if (!mark) return;
  const [a, b, , d] = cornersOf(mark, view);
  const at = (image, [x, y]) => {
    const i = 4 * (image.width * Math.round(y) + Math.round(x));
    return [...image.data.subarray(i, i + 4)];
  };
  const worst = [];
  for (let i = 0; i < SAMPLES * SAMPLES; ++i) {
    // Off the borders of the quarters, and the outline's halo.
    const [s, t] = [i % SAMPLES, Math.floor(i / SAMPLES)].map((k) => (k + 1) / (SAMPLES + 1));
    const point = plus(plus(a, times(minus(b, a), s)), times(minus(d, a), 1 - t));
    const [u, v] = pixelIn(view, point);
    const onPage = [
      ((u + 0.5) * marks.scale + marks.left) * marks.ratio - 0.5,
      ((v + 0.5) * marks.scale + marks.top) * marks.ratio - 0.5,
    ];
    const wanted = QUARTERS[(t < 0.5 ? 0 : 2) + (s < 0.5 ? 0 : 1)];
    const off = (image, place) =>
      Math.max(
        ...at(image, place)
          .slice(0, 3)
          .map((value, k) => Math.abs(value - wanted[k])),
      );
    worst.push({ page: off(page, onPage), server: off(server, [u, v]) });
  }
  // Some lie under a label or the outline of another mark.
  const share = (name) => worst.filter((each) => each[name] < PICTURE_OFF).length / worst.length;
  check(
    'a pinned picture shows the same upright on both',
    share('page') > 0.8 && share('server') > 0.8,
    `${(100 * share('page')).toFixed(0)} % of ${worst.length} places on the page, ` +
      `${(100 * share('server')).toFixed(0)} % on the server’s`,
  );
}
