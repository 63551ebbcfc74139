// Two people in two browsers on one wearable: every tool by mouse and by keyboard, what the other sees of it
// and how late, whose a change is, and what 200 marks cost.
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService, AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { barriers } from './axe.mjs';
import { benchmark } from './crowd.mjs';
import { Expert } from './expert.mjs';
import { samplePdf, samplePng } from './files.mjs';
import { inCamera, project } from './optics.mjs';
import { startServer } from './server.mjs';
import { byKeyboard } from './tools_keys.mjs';
import { togetherChecks } from './together.mjs';

// Two pages are drawn without a graphics card: what tracks the camera goes first.
const PREFIX = ['nice', '-n', '5'];

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runTools({ server: binary, chromium, seed, shots, folder, only, size }) {
  const [width, height] = size.split('x').map(Number);
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand&fps=10`],
    ...['--data-dir', join(folder, 'tools-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots, url: server.http, folder, chromium };
  context.open = { viewport: { width, height }, prefix: PREFIX };
  context.wants = (name) => !only || only.split(',').includes(name);
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
    context.ann = await Expert.open(chromium, `${server.http}/?name=Ann`, context.open);
    await context.ann.waitForStatus(/^tracking/, 60_000);
    await context.ann.page.locator('canvas.map[data-eye]').waitFor();
    await nameIsAskedOnce(context);
    await context.ann.enlarge('video');
    if (context.wants('mouse')) await byMouse(context);
    if (context.wants('keys')) await byKeyboard(context);
    await togetherChecks(context);
    if (context.wants('crowd')) await benchmark(context);
    if (context.wants('sizes')) await sizes(context);
    for (const name of ['ann', 'bo']) {
      const { errors } = context[name];
      context.check(`page errors, ${name}`, errors.length === 0, errors.join('; ') || 'none');
    }
  } finally {
    await context.ann?.close();
    await context.bo?.close();
    await server.stop();
  }
  return context.failures;
}

export async function shot({ shots, ann }, name, expert = ann) {
  if (shots) await expert.page.screenshot({ path: join(shots, `tools-${name}.png`) });
}

export const listOf = async ({ annotations }) => (await annotations.list({})).annotations;

/** Waits until the server's annotations are as wanted; gives what `found` made of them, or undefined. */
export async function listWhen(context, found, timeoutMs = 8000) {
  for (const end = Date.now() + timeoutMs; Date.now() < end; await sleep(60)) {
    const result = found(await listOf(context));
    if (result) return result;
  }
  return undefined;
}

/** A place in the picture, as shares of it. */
export async function placeIn(expert, x, y) {
  const { left, top, scale, width, height } = await expert.look();
  return [left + x * width * scale, top + y * height * scale];
}

/** Waits until the camera is placed; where it has been lost for long, begins the map anew as a person would. */
export async function tracked({ ann, map, owner }) {
  for (let tries = 0; tries < 4; ++tries) {
    const placed = await ann.waitForStatus(/^tracking/, 10_000).then(
      () => true,
      () => false,
    );
    if (placed) return;
    console.log('      lost: the map is begun anew');
    await map.reset({ sessionId: owner });
  }
  throw new Error('the camera is not placed');
}

/**
 * Waits for a mark of a shape that was not there; its annotation, or undefined. A loaded computer loses the
 * camera now and then, and the page says so: then it is done again, as a person would.
 */
export async function made(context, shape, act) {
  for (let tries = 0; ; ++tries) {
    await tracked(context);
    const before = new Set((await listOf(context)).map(({ id }) => id));
    await act();
    const mark = await listWhen(context, (list) =>
      list.find((each) => !before.has(each.id) && each.shape === shape),
    );
    if (mark || tries === 2) return mark;
    console.log(`      again: ${await noteOf(context.ann)}`);
  }
}

/** Does what opens a dialog until it is open, as `made`. */
export async function opened(context, selector, act) {
  const { ann } = context;
  const dialog = ann.page.locator(`dialog[open] ${selector}`);
  for (let tries = 0; ; ++tries) {
    await tracked(context);
    await act();
    const open = await dialog.waitFor({ timeout: 6000 }).then(
      () => true,
      () => false,
    );
    if (open) return;
    if (tries === 3) throw new Error(`no dialog: ${await noteOf(ann)}`);
  }
}

/** What a pane says. */
export const noteOf = (expert, pane = '.video') =>
  expert.page.locator(`${pane} .pane-note`).innerText();

async function dialogChecks(context, name, expert = context.ann) {
  const found = await barriers(expert.page);
  context.check(`${name}, axe`, found.length === 0, found.join('; ') || 'none');
  await shot(context, name.replaceAll(' ', '-'), expert);
}

async function nameIsAskedOnce(context) {
  const { check, chromium, url } = context;
  context.bo = await Expert.open(chromium, `${url}/`, { ...context.open, nameless: true });
  const { page } = context.bo;
  await page.locator('dialog[open] #own-name').waitFor({ timeout: 30_000 });
  await dialogChecks(context, 'dialog of the name', context.bo);
  await page.keyboard.type('Bo');
  await page.keyboard.press('Enter');
  await tracked(context);
  const person = context.ann.page.locator('.participant .who', { hasText: /^Bo$/ });
  await person.waitFor({ state: 'attached', timeout: 30_000 });
  await page.reload();
  await page.locator('.app[data-first-picture-ms]').waitFor();
  await tracked(context);
  const again = await page.locator('dialog[open]').count();
  await person.waitFor({ state: 'attached', timeout: 30_000 }); // he was gone for the reload
  const key = await page.evaluate(() => window.localStorage.getItem('saccade.person'));
  const colours = await context.ann.page
    .locator('.participant .person')
    .evaluateAll((all) => all.map((each) => getComputedStyle(each).backgroundColor));
  check(
    'a name is asked for once, and seen by the other with a colour of its own',
    again === 0 && /^[A-Za-z0-9_-]{32,64}$/.test(key) && new Set(colours).size === 2,
    `asked again ${again} times; colours ${colours.join(' and ')}`,
  );
  await context.bo.enlarge('video');
}

/** Every tool once by the mouse. */
export async function byMouse(context) {
  const { ann, check } = context;
  const { page } = ann;
  const click = async (key, x, y) => {
    await ann.press(key);
    await ann.click(await placeIn(ann, x, y));
  };
  const drag = async (from, to) => {
    await page.mouse.move(...(await placeIn(ann, ...from)));
    await page.mouse.down();
    for (let i = 1; i <= 6; ++i) {
      const at = from.map((value, axis) => value + ((to[axis] - value) * i) / 6);
      await page.mouse.move(...(await placeIn(ann, ...at)));
    }
    await page.mouse.up();
  };

  const one = await made(context, AnnotationShape.PIN, () => click('1', 0.42, 0.5));
  const two = await made(context, AnnotationShape.PIN, () => click('1', 0.5, 0.42));
  check(
    'pins are numbered',
    one && two?.number === one.number + 1,
    `${one?.number} and ${two?.number ?? (await noteOf(ann))}`,
  );

  const cubic = await made(context, AnnotationShape.BOX, () => click('b', 0.36, 0.62));
  await ann.press('b');
  const box = await made(context, AnnotationShape.BOX, () => drag([0.52, 0.5], [0.62, 0.62]));
  const { x = 0, y = 0, z = 0 } = box?.extentM ?? {};
  check(
    'a box is as large as it was drawn',
    cubic && Math.abs(cubic.extentM.x - 0.1) < 1e-6 && x > 0.02 && y > 0.02 && z > 0.005,
    box ? `${[x, y, z].map((v) => (1000 * v).toFixed(0)).join(' x ')} mm` : await noteOf(ann),
  );

  const measure = await made(context, AnnotationShape.MEASURE, async () => {
    await click('d', 0.42, 0.44);
    await page.mouse.move(...(await placeIn(ann, 0.6, 0.44)));
    await sleep(500);
    await shot(context, 'measuring');
    await ann.click(await placeIn(ann, 0.6, 0.44));
  });
  check(
    'a distance has a length and a sigma',
    measure?.lengthM > 0.05 && measure.lengthM < 2 && measure.lengthSigmaM > 0,
    measure
      ? `${(1000 * measure.lengthM).toFixed(1)} ± ${(1000 * measure.lengthSigmaM).toFixed(1)} mm`
      : await noteOf(ann),
  );

  await opened(context, '#list-title', () => click('j', 0.62, 0.5));
  await dialogChecks(context, 'dialog of the check list');
  await page.keyboard.type('Pump');
  await page.locator('#list-lines').fill('close the valve\nopen the lid');
  const list = await made(context, AnnotationShape.CHECK_LIST, () =>
    page.getByRole('button', { name: 'Place it' }).first().click(),
  );
  const row = page.locator(`aside li[data-id="${list?.id}"]`);
  await row.locator('input[type="checkbox"]').first().click();
  const ticked = await listWhen(context, (all) =>
    all.find(({ id, checkItems }) => id === list?.id && checkItems[0]?.done),
  );
  check(
    'a check list is ticked off in the list, under a name',
    ticked?.checkItems.length === 2 && ticked.checkItems[0].doneBy === 'Ann',
    ticked ? `"${ticked.checkItems[0].text}" by ${ticked.checkItems[0].doneBy}` : await noteOf(ann),
  );

  await pictures(context, click);

  await ann.press('i');
  const ink = await made(context, AnnotationShape.INK, () => drag([0.4, 0.3], [0.6, 0.34]));
  check(
    'ink is a stroke, and the picture goes on after it',
    ink?.inkOffsetM.length >= 2 && !(await page.locator('.video.frozen').isVisible()),
    ink ? `${ink.inkOffsetM.length} points` : await noteOf(ann),
  );

  const arrow = await made(context, AnnotationShape.ARROW, () => click('a', 0.55, 0.6));
  await ann.press('v');
  await sleep(800);
  await ann.press('p'); // a page that draws three times a second shows the handle where it was
  await page.locator('.video.frozen').waitFor();
  await sleep(500);
  const handle = await handleAt(context, arrow);
  const to = [handle[0] + 60, handle[1] + 40];
  await page.mouse.move(...handle);
  await page.mouse.down();
  await page.mouse.move(to[0], to[1], { steps: 5 });
  await sleep(200);
  await shot(context, 'turning');
  await page.mouse.up();
  const turned = await listWhen(context, (all) =>
    all.find(({ id, worldFromMark: q }) => id === arrow?.id && q && Math.abs(q.w) < 0.995),
  );
  check(
    'an arrow is turned by its handle',
    turned !== undefined,
    turned ? `w ${turned.worldFromMark.w.toFixed(3)}` : await noteOf(ann),
  );
  await ann.press('p');
  await moved(context, turned ?? arrow);
}

/** The frame that the video shows: the frozen one, where it is. */
const shownId = async (expert) => {
  const still = expert.page.locator('canvas.still');
  if ((await still.count()) > 0) return Number(await still.getAttribute('data-frame-id'));
  return (await expert.look()).id;
};

/** Where the page draws the handle of the selected arrow: the end of its first line. */
async function handleAt({ ann, session }, arrow) {
  const id = await shownId(ann);
  const at = await pixelOf(session, id, arrow.anchor.pointInWorldM, { y: -2 * arrow.sizeM });
  const { left, top, scale } = await ann.look();
  return [left + (at[0] + 0.5) * scale, top + (at[1] + 0.5) * scale];
}

/** Where a point of the world, moved by so much, appears in a frame that the server keeps. */
export async function pixelOf(session, frameId, point, { x = 0, y = 0, z = 0 } = {}) {
  const { intrinsics, pose } = await session.getFrame({ frameId: BigInt(frameId) });
  const { rotation: q, translationM: t } = pose.worldFromCamera;
  const camera = { rotation_xyzw: [q.x, q.y, q.z, q.w], translation_m: [t.x, t.y, t.z] };
  return project(intrinsics, inCamera(camera, [point.x + x, point.y + y, point.z + z]));
}

/** Where the anchor of a mark appears on the page now. */
export async function onPage({ session }, expert, annotation) {
  const id = await shownId(expert);
  const [u, v] = await pixelOf(session, id, annotation.anchor.pointInWorldM);
  const { left, top, scale } = await expert.look();
  return [left + (u + 0.5) * scale, top + (v + 0.5) * scale];
}

/** Dragging moves a selected mark with one update; Escape gives it up. */
async function moved(context, mark) {
  const { ann, check, annotations } = context;
  const { page } = ann;
  const revision = async () => {
    const { annotations: all } = await annotations.list({});
    return all.find(({ id }) => id === mark.id);
  };
  await ann.press('v');
  await selectRow(ann, mark.id);
  // In a picture that stands still: in a live one that is drawn seldom the mark is elsewhere meanwhile.
  await tracked(context);
  await ann.press('p');
  await page.locator('.video.frozen').waitFor();
  await sleep(500);
  const before = await revision();
  const from = await onPage(context, ann, before);
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(from[0] - 60, from[1] - 50, { steps: 5 });
  await ann.press('Escape');
  await page.mouse.up();
  await sleep(600);
  const given = await revision();
  const again = await onPage(context, ann, given);
  await page.mouse.move(...again);
  await page.mouse.down();
  await page.mouse.move(again[0] - 60, again[1] - 50, { steps: 5 });
  await sleep(200);
  await shot(context, 'moving');
  await page.mouse.up();
  const away = (a, b) =>
    Math.hypot(
      a.anchor.pointInWorldM.x - b.anchor.pointInWorldM.x,
      a.anchor.pointInWorldM.y - b.anchor.pointInWorldM.y,
    );
  const after = await listWhen(context, (all) =>
    all.find((each) => each.id === mark.id && away(each, given) > 0.02),
  );
  check(
    'a selected mark is dragged; Escape leaves it where it was',
    given.revision === before.revision && after?.revision === given.revision + 1n,
    after
      ? `moved ${(1000 * away(after, given)).toFixed(0)} mm, revisions ${before.revision}, ${given.revision}, ${after.revision}`
      : await noteOf(ann),
  );
  await ann.press('p');
}

export async function selectRow({ page }, id) {
  const row = page.locator(`aside li[data-id="${id}"]`);
  if (await row.evaluate((li) => li.classList.contains('selected'))) return;
  await row.locator('.pick').click();
  await page.locator(`aside li.selected[data-id="${id}"]`).waitFor();
}

async function pictures(context, click) {
  const { ann, check, folder } = context;
  const { page } = ann;
  await opened(context, '#picture-file', () => click('u', 0.3, 0.42));
  await page.locator('#picture-file').setInputFiles(samplePng(folder));
  const place = page.locator('dialog[open] button.main');
  await page.locator('dialog[open] .preview canvas').waitFor({ timeout: 15_000 });
  await page.locator('#picture-text').fill('wiring');
  await dialogChecks(context, 'dialog of the picture');
  const png = await made(context, AnnotationShape.PICTURE, () => place.click());
  check(
    'a picture is pinned to a place',
    png?.picture?.width === 320 && png.picture.mediaType === 'image/png' && png.text === 'wiring',
    png
      ? `${png.picture.width} x ${png.picture.height}, ${png.picture.mediaType}`
      : await noteOf(ann),
  );

  // Not from the page's own list of what it fetched: that ends at 250.
  const fetched = [];
  page.on('request', (request) => fetched.push(request.url()));
  const loaded = () => fetched.some((address) => /\/pdf[.-]/.test(address));
  const before = await page.evaluate(() =>
    performance.getEntriesByType('resource').some(({ name }) => /\/pdf[.-]/.test(name)),
  );
  await opened(context, '#picture-file', () => click('u', 0.7, 0.36));
  await page.locator('#picture-file').setInputFiles(samplePdf(folder));
  await page.locator('dialog[open] .pages', { hasText: 'of 2' }).waitFor({ timeout: 30_000 });
  await page.locator('#picture-page').fill('2');
  await page.locator('#picture-page').press('Tab');
  await page.locator('dialog[open] canvas[aria-label="Page 2"]').waitFor({ timeout: 20_000 });
  await dialogChecks(context, 'dialog of the PDF page');
  const green = await page.locator('dialog[open] .preview canvas').evaluate((canvas) => {
    const { data } = canvas
      .getContext('2d')
      .getImageData(canvas.width / 2, canvas.height / 2, 1, 1);
    return [...data];
  });
  const pdf = await made(context, AnnotationShape.PICTURE, () => place.click());
  const [r, g, b] = green;
  check(
    'so is a page of a PDF, whose reader is loaded with the first one',
    pdf && !before && loaded() && g > 150 && r < 80 && b < 80,
    pdf
      ? `${pdf.picture.width} x ${pdf.picture.height}, its middle ${green.join()}`
      : await noteOf(ann),
  );
  await ann.press('v');
  await ann.press('Escape');
  await sleep(1500);
  await shot(context, 'pictures');
  const seen = await greenIn(context.bo.page);
  check(
    'the other sees it in the picture, once its bytes are there',
    seen > 50,
    `${seen} pixels of its green`,
  );
}

/** Pixels of the PDF page's green on the marks of the video. */
export const greenIn = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector('.video canvas.marks');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4)
      count += data[i] < 80 && data[i + 1] > 150 && data[i + 2] < 80 && data[i + 3] > 200 ? 1 : 0;
    return count;
  });

/** Screens to be looked at. */
async function sizes(context) {
  const { ann, shots } = context;
  if (!shots) return;
  for (const scheme of ['dark', 'light']) {
    await ann.page.emulateMedia({ colorScheme: scheme });
    for (const [width, height] of [
      [1280, 720],
      [360, 640],
      [3440, 1440],
    ]) {
      await ann.page.setViewportSize({ width, height });
      await sleep(1200);
      await shot(context, `${scheme}-${width}`);
    }
  }
}
