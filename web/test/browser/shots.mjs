// Pictures of the page and of the wearer's view at seven sizes, light and dark, with people, marks of every
// shape, messages and somebody who points: to be looked at. Makes files, checks only that the pages came.
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService, AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { PointerKind, PointerService } from '../../src/gen/saccade/v1/pointer_pb.js';
import { Role, SessionService, Topic } from '../../src/gen/saccade/v1/session_pb.js';
import { TalkService } from '../../src/gen/saccade/v1/talk_pb.js';
import { VideoView } from '../../src/gen/saccade/v1/video_pb.js';
import { featuresNear } from './drawn_shapes.mjs';
import { Expert } from './expert.mjs';
import { samplePng } from './files.mjs';
import { SIZES } from './layout.mjs';
import { startServer } from './server.mjs';

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const STRAIGHT = { x: 0, y: Math.sin(0.35), z: 0, w: Math.cos(0.35) };

/** In the picture's pixels (640 x 480). */
const MARKS = [
  { shape: AnnotationShape.CUBE, at: [140, 80] },
  { shape: AnnotationShape.NOTE, at: [345, 410], text: 'oil: check the level first' },
  { shape: AnnotationShape.ARROW, at: [560, 190], sizeM: 0.08 },
  { shape: AnnotationShape.PIN, at: [50, 300], text: 'leaks', sizeM: 0.08 },
  { shape: AnnotationShape.PIN, at: [130, 290], sizeM: 0.08 },
  { shape: AnnotationShape.MEASURE, at: [260, 200], to: [420, 205] },
  {
    ...{ shape: AnnotationShape.BOX, at: [290, 50] },
    ...{ extentM: { x: 0.14, y: 0.1, z: 0.08 }, worldFromMark: STRAIGHT },
  },
  { shape: AnnotationShape.PICTURE, at: [160, 400], sizeM: 0.16, text: 'wiring' },
  {
    ...{ shape: AnnotationShape.CHECK_LIST, at: [530, 340], text: 'Service', sizeM: 0.08 },
    checkItems: ['close the valve', 'open the lid', 'change the filter'],
  },
  {
    ...{ shape: AnnotationShape.INK, at: [340, 270] },
    inkOffsetM: Array.from({ length: 42 }, (_, i) => ({
      ...{ x: 0.1 * Math.cos(i / 6.4), y: 0.07 * Math.sin(i / 6.4), z: 0 },
    })),
  },
];

export async function runShots({ server: binary, chromium, seed, shots, folder }) {
  if (!shots) throw new Error('--shots: say which folder the pictures go to');
  mkdirSync(shots, { recursive: true });
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand&fps=10`, '--mount', 'sim'],
    ...['--data-dir', join(folder, 'shots-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { shots, url: server.http };
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.client = (service) => createClient(service, transport);
    context.expert = await Expert.open(chromium, `${server.http}/?name=Ann`, { look: '' });
    await context.expert.waitForStatus(/^tracking/, 60_000);
    await context.expert.page.locator('canvas.map[data-eye]').waitFor();
    const points = await fill(context);
    await thePage(context);
    await theWearer(context);
    globalThis.clearInterval(points);
    console.log(`ok    pictures in ${shots}`);
  } finally {
    await context.expert?.close();
    await server.stop();
  }
  return 0;
}

/** Until the camera has been placed for some seconds: marks on a young map are not trusted. */
async function settled(expert) {
  const { page } = expert;
  await page.locator('canvas.picture[data-frame-id]:not([data-frame-id=""])').first().waitFor();
  for (let steady = 0, i = 0; steady < 8 && i < 120; ++i) {
    const text = await page.locator('header .status strong').innerText();
    steady = text === 'tracking good' ? steady + 1 : 0;
    await sleep(500);
  }
}

/** Somebody who is there: the wearer sees who watches. */
async function watches(session, sessionId) {
  for (let i = 0; i < 100; ++i) {
    try {
      const stream = session.subscribe({ sessionId, topics: [Topic.PRESENCE], window: 32 });
      for await (const event of stream) if (!event) break;
    } catch {
      await sleep(1000); // nothing is acknowledged, so it ends now and then; in the end with the server
    }
  }
}

/** Another expert, who places marks, says something and goes on pointing. */
async function fill({ client, expert, shots }) {
  const [session, annotations] = [client(SessionService), client(AnnotationService)];
  const { sessionId, colorRgba } = await session.join({ displayName: 'Bea', role: Role.EXPERT });
  void watches(session, sessionId);
  await settled(expert);
  // Where the map is sure: on a blank wall it would not be trusted.
  const near = await featuresNear({ session, map: client(MapService) });
  const target = (at) => ({ target: { case: 'featureId', value: near(at)[0].feature.id } });
  for (const { at, to, ...draft } of MARKS) {
    const picture =
      draft.shape === AnnotationShape.PICTURE
        ? new Uint8Array(readFileSync(samplePng(shots)))
        : undefined;
    await annotations
      .create({
        ...{ requestId: globalThis.crypto.randomUUID(), sessionId },
        draft: { colorRgba, ...draft, target: target(at), endTarget: to && target(to), picture },
      })
      .catch((error) => console.log(`      not placed: ${error.rawMessage}`));
  }
  const said = (text) =>
    client(TalkService).say({ sessionId, requestId: globalThis.crypto.randomUUID(), text });
  await said('The valve is the brass one, left of the pump.');
  await said('Tell me when it is closed.');
  const pointers = client(PointerService);
  const strokeId = globalThis.crypto.randomUUID();
  const { annotations: all } = await annotations.list({});
  const { x, y, z } = all.find(({ anchor }) => anchor?.pointInWorldM).anchor.pointInWorldM;
  const value = { x: x + 0.25, y: y + 0.05, z };
  const points = [{ target: { case: 'pointInWorldM', value } }];
  const point = () => pointers.point({ sessionId, strokeId, kind: PointerKind.LASER, points });
  return globalThis.setInterval(() => void point().catch(() => undefined), 300);
}

async function eachSize({ expert, shots }, name, settle, ready) {
  const { page } = expert;
  for (const scheme of ['dark', 'light']) {
    await page.emulateMedia({ colorScheme: scheme });
    for (const { width, height } of SIZES) {
      await page.setViewportSize({ width, height });
      await sleep(settle);
      await ready();
      await page.screenshot({
        path: join(shots, `${name}-${scheme}-${width}.png`),
        timeout: 120_000,
      });
    }
  }
}

async function thePage(context) {
  const { expert, shots } = context;
  const { page } = expert;
  await page.locator('aside li .pick').first().waitFor();
  const tracking = () => expert.waitForStatus(/^tracking/, 15_000).catch(() => undefined);
  await eachSize(context, 'page', 1500, tracking);
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.emulateMedia({ colorScheme: 'dark' });
  await expert.enlarge('video');
  await sleep(1500);
  await page.screenshot({ path: join(shots, 'page-video.png') });
}

async function theWearer(context) {
  const { expert, client, url, shots } = context;
  const { page } = expert;
  await page.goto(`${url}/wearer`);
  await page.locator('canvas.picture[data-frame-id]').waitFor({ timeout: 30_000 });
  // Its line of words is gone where all is well.
  const well = () =>
    page
      .locator('.line.hidden')
      .waitFor({ state: 'attached', timeout: 15_000 })
      .catch(() => undefined);
  await eachSize(context, 'wearer', 1200, well);
  const { png } = await client(SessionService).getFrame({ view: VideoView.AUGMENTED });
  writeFileSync(join(shots, 'augmented.png'), png);
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.keyboard.press('p');
  await sleep(1500);
  await page.screenshot({ path: join(shots, 'wearer-paused.png') });
}
