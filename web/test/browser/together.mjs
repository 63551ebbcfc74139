// Two people at once: what one points at and draws as the other sees it, whose a change is, whose a mark.
import { AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { Role } from '../../src/gen/saccade/v1/session_pb.js';
import { laser } from './laser.mjs';
import { inCamera } from './optics.mjs';
import {
  listOf,
  listWhen,
  made,
  noteOf,
  onPage,
  placeIn,
  selectRow,
  shot,
  sleep,
  tracked,
} from './tools.mjs';
import { pointersOn } from './tools_keys.mjs';

const CHECKS = {
  laser,
  laserInOtherViews,
  growingInk,
  undoIsThePersons,
  concurrent,
  several,
  copied,
  locked,
  shownWhere,
  dropped,
  viewer,
};

export async function togetherChecks(context) {
  for (const [name, run] of Object.entries(CHECKS)) if (context.wants(name)) await run(context);
}

/** In the frozen picture and in the map as well. */
async function laserInOtherViews(context) {
  const { ann, bo, check } = context;
  const { page } = ann;
  const held = async (from, to) => {
    await page.mouse.move(...from);
    await page.mouse.down();
    await page.mouse.move(...to, { steps: 4 });
    let seen = '';
    for (const end = Date.now() + 4000; !seen && Date.now() < end; await sleep(50)) {
      seen = await pointersOn(bo.page);
    }
    await page.mouse.up();
    return seen;
  };
  await ann.press('w');
  await ann.press('p');
  await page.locator('canvas.still').waitFor();
  const frozen = await held(await placeIn(ann, 0.5, 0.5), await placeIn(ann, 0.55, 0.5));
  await ann.press('p');
  await ann.enlarge('map');
  await ann.press('h');
  await sleep(1200);
  const mark = (await listOf(context)).find(({ anchor }) => anchor?.pointInWorldM);
  const at = await inMap(ann, mark.anchor.pointInWorldM);
  const before = await ann.mapView();
  const map = await held(at, [at[0] + 4, at[1] + 4]);
  const after = await ann.mapView();
  await ann.press('v');
  await ann.enlarge('video');
  check(
    'so it is from the frozen picture and from the map, which does not turn meanwhile',
    /^Ann laser/.test(frozen) &&
      /^Ann laser/.test(map) &&
      String(before.pose.rotation_xyzw) === String(after.pose.rotation_xyzw),
    `"${frozen}", "${map}"`,
  );
}

/** Where a point of the world appears on the page in the map. */
async function inMap(expert, { x, y, z }) {
  const { pose, focal, left, top, width, height } = await expert.mapView();
  const [a, b, c] = inCamera(pose, [x, y, z]);
  return [left + width / 2 + (focal * a) / c, top + height / 2 + (focal * b) / c];
}

async function growingInk(context) {
  const { ann, bo, check } = context;
  const { page } = ann;
  await tracked(context);
  await ann.press('i');
  const [x, y] = await placeIn(ann, 0.38, 0.5);
  await page.mouse.move(x, y);
  await page.mouse.down();
  const began = Date.now();
  // What others draw has a canvas of its own: all that is on it is the stroke.
  const grown = [];
  const look = async () => {
    const { words, pixels } = await strokeOn(bo.page);
    const length = Number(/sketch -?[\d.]+ -?[\d.]+ (\d+)/.exec(words)?.[1] ?? 0);
    if (length !== grown.at(-1)?.length) grown.push({ length, pixels });
  };
  for (let i = 0; i < 60; ++i) {
    await page.mouse.move(x + 4 * i, y + 40 * Math.sin(i / 6));
    await sleep(25);
    if (i % 6 === 5) await look();
  }
  const drewMs = Date.now() - began;
  await sleep(300);
  await look();
  await shot(context, 'ink-growing', bo);
  const live = await pointersOn(bo.page);
  const ink = await made(context, AnnotationShape.INK, () => page.mouse.up());
  const row = bo.page.locator(`aside li[data-id="${ink?.id}"]`);
  await row.waitFor({ timeout: 15_000 });
  let after = live;
  for (const end = Date.now() + 5000; after && Date.now() < end; await sleep(50)) {
    after = await pointersOn(bo.page);
  }
  const [first, last] = [grown.find(({ length }) => length > 0), grown.at(-1)];
  const rises = grown.every(({ length }, i) => i === 0 || length > 0.9 * grown[i - 1].length);
  check(
    'ink grows before the other’s eyes while it is drawn, and stays as a mark',
    /^Ann sketch/.test(live) &&
      after === '' &&
      grown.length >= 4 &&
      rises &&
      last.length > 2 * first.length &&
      last.pixels > 1.5 * first.pixels,
    `${grown.map(({ length, pixels }) => `${length} px long, ${pixels} painted`).join('; ')}; ` +
      `in ${drewMs} ms; ${ink?.inkOffsetM.length} points kept`,
  );
  await ann.press('v');
}

/** What a page says of others' pointers on its video, and how many pixels it painted for them. */
const strokeOn = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector('.video canvas.pointers');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let pixels = 0;
    for (let i = 3; i < data.length; i += 4) pixels += data[i] > 0 ? 1 : 0;
    return { words: canvas.dataset.pointers ?? '', pixels: canvas.hidden ? 0 : pixels };
  });

/** Another session of the same person, as after the browser was closed: what was done can be undone. */
async function undoIsThePersons(context) {
  const { ann, bo, check } = context;
  const { page } = ann;
  await ann.press('c');
  const cube = await made(context, AnnotationShape.CUBE, async () =>
    ann.click(await placeIn(ann, 0.45, 0.35)),
  );
  await bo.press('c');
  const other = await made(context, AnnotationShape.CUBE, async () =>
    bo.click(await placeIn(bo, 0.55, 0.35)),
  );
  await bo.press('v');
  await page.evaluate(() => sessionStorage.clear());
  await page.goto('about:blank');
  await sleep(500);
  await page.goto(`${context.url}/?name=Annette`);
  await tracked(context);
  await page.locator(`aside li[data-id="${cube?.id}"]`).waitFor({ timeout: 15_000 });
  await ann.press('o');
  await sleep(600);
  const mine = await page.locator(`aside li[data-id="${cube?.id}"]`).count();
  const theirs = await page.locator(`aside li[data-id="${other?.id}"]`).count();
  await ann.press('o');
  await ann.press('z');
  const gone = await listWhen(context, (all) => !all.some(({ id }) => id === cube?.id));
  const left = (await listOf(context)).some(({ id }) => id === other?.id);
  check(
    'a new session under a new name is still the same person: undo, and "only mine"',
    Boolean(gone) && left && mine === 1 && theirs === 0,
    `${gone ? 'undone' : 'not undone'}, the other's ${left ? 'stays' : 'gone'}; only mine lists ${mine} and ${theirs}`,
  );
  await page.goto(`${context.url}/?name=Ann`);
  await tracked(context);
  await page.locator('canvas.map[data-eye]').waitFor();
  await ann.enlarge('video');
}

async function concurrent(context) {
  const { ann, bo, check } = context;
  await ann.press('c');
  const cube = await made(context, AnnotationShape.CUBE, async () =>
    ann.click(await placeIn(ann, 0.5, 0.5)),
  );
  await ann.press('v');
  for (const expert of [ann, bo]) {
    await expert.page.locator(`aside li[data-id="${cube.id}"]`).waitFor({ timeout: 8000 });
    await selectRow(expert, cube.id);
  }
  const paint = (expert, name) =>
    expert.page.locator('.palette').getByRole('button', { name, exact: true }).click();
  await Promise.all([paint(ann, 'orange'), paint(bo, 'pink')]);
  await sleep(1500);
  const colourOn = ({ page }) =>
    page
      .locator(`aside li[data-id="${cube.id}"]`)
      .evaluate((li) => li.style.getPropertyValue('--mark'));
  const colours = [await colourOn(ann), await colourOn(bo)];
  const server = (await listOf(context)).find(({ id }) => id === cube.id);
  const told = `#${(server.colorRgba >>> 8).toString(16).padStart(6, '0')}`;
  await Promise.all([ann.press('Delete'), bo.press('Delete')]);
  const gone = await listWhen(context, (all) => !all.some(({ id }) => id === cube.id));
  await sleep(800);
  const rows = await Promise.all(
    [ann, bo].map(({ page }) => page.locator(`aside li[data-id="${cube.id}"]`).count()),
  );
  check(
    'two who change one mark at once see the same in the end',
    colours.every((colour) => colour === told) && Boolean(gone) && rows.join() === '0,0',
    `colours ${colours.join(', ')}, server ${told}; after both deleted it ${rows.join(' and ')} rows`,
  );
  await bo.press('Escape');
}

/** A rectangle, one deletion, one undo. */
async function several(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('v');
  await ann.press('Escape');
  const [left, top] = await placeIn(ann, 0.31, 0.32);
  const [right, bottom] = await placeIn(ann, 0.66, 0.7);
  await ann.press('2');
  await page.mouse.move(left, top);
  await page.mouse.down();
  await page.mouse.move(right, bottom, { steps: 4 });
  await sleep(300);
  await shot(context, 'area');
  await page.mouse.up();
  await page.locator('aside li.selected').first().waitFor({ timeout: 10_000 });
  const chosen = await page.locator('aside li.selected').count();
  await ann.press('v');
  const before = (await listOf(context)).length;
  await ann.press('Delete');
  const fewer = await listWhen(context, (all) => all.length === before - chosen && all);
  await ann.press('z');
  const back = await listWhen(context, (all) => all.length === before && all);
  check(
    'several are deleted together, and one undo brings all of them back',
    chosen > 1 && Boolean(fewer) && Boolean(back),
    `${chosen} of ${before} selected, ${fewer?.length ?? (await listOf(context)).length} left, ${back?.length ?? '?'} after undo`,
  );
}

/** From the video to the map. */
async function copied(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('v');
  await ann.press('Escape');
  const all = await listOf(context);
  const [one, two] = all.filter(({ shape }) => shape === AnnotationShape.PIN);
  await selectRow(ann, one.id);
  await page.locator(`aside li[data-id="${two.id}"] .pick`).click({ modifiers: ['Shift'] });
  await ann.press('Control+c');
  await ann.enlarge('map');
  await ann.press('h');
  await sleep(1200);
  const at = await inMap(ann, one.anchor.pointInWorldM);
  await page.mouse.move(at[0] + 3, at[1] + 3);
  await sleep(200);
  await ann.press('Control+v');
  const pasted = await listWhen(context, (list) => list.length === all.length + 2 && list);
  await ann.press('z');
  const undone = await listWhen(context, (list) => list.length === all.length && list);
  const news = (pasted ?? []).filter(({ id }) => !all.some((each) => each.id === id));
  check(
    'two marks copied in the video are pasted in the map, and undone together',
    news.length === 2 &&
      news.every(({ shape }) => shape === AnnotationShape.PIN) &&
      Boolean(undone),
    pasted
      ? `${news.map(({ number }) => `pin ${number}`).join(', ')}; ${undone ? 'undone' : 'not undone'}`
      : `${await noteOf(ann, '.map3d')} ${await page.locator('.reason:not(:empty)').allInnerTexts()}`,
  );
  await ann.enlarge('video');
}

async function locked(context) {
  const { ann, bo, check } = context;
  await ann.press('v');
  await ann.press('Escape');
  await bo.press('v');
  await bo.press('Escape');
  const mine = (await listOf(context)).find(
    ({ shape, author }) => shape === AnnotationShape.PIN && author === 'Ann',
  );
  await selectRow(ann, mine.id);
  await ann.press('3');
  const held = await listWhen(context, (all) =>
    all.find(({ id, locked: is }) => id === mine.id && is),
  );
  await bo.page.locator(`aside li[data-id="${mine.id}"] .locked:not(.hidden)`).waitFor();
  await selectRow(bo, mine.id);
  await bo.press('Delete');
  await sleep(500);
  const reason = await bo.page.locator('.tool .reason:not(:empty)').first().innerText();
  const at = await onPage(context, bo, mine);
  await bo.page.mouse.move(...at);
  await bo.page.mouse.down();
  await bo.page.mouse.move(at[0] + 40, at[1] + 30, { steps: 4 });
  await bo.page.mouse.up();
  let note = '';
  for (const end = Date.now() + 4000; !/Locked/.test(note) && Date.now() < end; await sleep(80)) {
    note = await noteOf(bo);
  }
  await shot(context, 'locked', bo);
  // Nor does the server take it, from whoever asks.
  const intruder = await context.session.join({ displayName: 'Cy', role: Role.EXPERT });
  const refused = await context.annotations
    .delete({ sessionId: intruder.sessionId, id: mine.id })
    .then(
      () => '',
      (error) => error.rawMessage,
    );
  const still = (await listOf(context)).find(({ id }) => id === mine.id);
  await ann.press('3');
  const free = await listWhen(context, (all) =>
    all.find(({ id, locked: is }) => id === mine.id && !is),
  );
  check(
    'a locked mark is refused to the other, who is told why',
    Boolean(held) &&
      still?.revision === held.revision &&
      /^Locked by Ann/.test(reason) &&
      /Locked by Ann/.test(note) &&
      refused !== '' &&
      Boolean(free),
    `"${reason}", "${note}"; the server: "${refused}"`,
  );
  await bo.press('Escape');
}

/** A mark out of view is turned to when its row is chosen. */
async function shownWhere(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('v');
  await ann.press('Escape');
  await ann.enlarge('map');
  await page.locator('.map3d').focus();
  for (let i = 0; i < 18; ++i) await ann.press('Shift+ArrowRight');
  await sleep(500);
  const mark = (await listOf(context)).find(({ anchor }) => anchor?.pointInWorldM);
  const { left, top, width, height } = await ann.mapView();
  const inside = ([x, y]) => x > left && y > top && x < left + width && y < top + height;
  const before = inside(await inMap(ann, mark.anchor.pointInWorldM));
  await selectRow(ann, mark.id);
  await sleep(900);
  const after = inside(await inMap(ann, mark.anchor.pointInWorldM));
  check(
    'a mark chosen in the list is brought into view',
    !before && after,
    `${before ? 'in view' : 'out of view'}, then ${after ? 'in view' : 'out of view'}`,
  );
  await ann.press('h');
  await ann.enlarge('video');
}

/** A file dropped on the picture. */
async function dropped(context) {
  const { ann, check } = context;
  const { page } = ann;
  const [clientX, clientY] = await placeIn(ann, 0.5, 0.4);
  await page.evaluate(
    async ([x, y]) => {
      const canvas = document.createElement('canvas');
      canvas.width = canvas.height = 3000; // noise: no PNG of it fits
      const context2d = canvas.getContext('2d');
      const noise = context2d.createImageData(3000, 3000);
      for (let i = 0; i < noise.data.length; i += 4) {
        noise.data[i] = (i * 7919) % 251;
        noise.data[i + 1] = Math.random() * 255;
        noise.data[i + 2] = Math.random() * 255;
        noise.data[i + 3] = 255;
      }
      context2d.putImageData(noise, 0, 0);
      const blob = await new Promise((resolve) => canvas.toBlob(resolve, 'image/webp', 0.6));
      const data = new window.DataTransfer();
      data.items.add(new window.File([blob], 'photo.webp', { type: 'image/webp' }));
      const init = { clientX: x, clientY: y, dataTransfer: data, bubbles: true, cancelable: true };
      const pane = document.querySelector('.video');
      pane.dispatchEvent(new window.DragEvent('dragover', init));
      pane.dispatchEvent(new window.DragEvent('drop', init));
    },
    [clientX, clientY],
  );
  await page.locator('dialog[open] .preview canvas').waitFor({ timeout: 60_000 });
  const words = await page.locator('dialog[open] .news').innerText();
  const picture = await made(context, AnnotationShape.PICTURE, () =>
    page.locator('dialog[open] button.main').click(),
  );
  check(
    'a WebP that is dropped there becomes a JPEG that fits',
    picture?.picture?.mediaType === 'image/jpeg' && picture.picture.width <= 4096,
    picture ? `${words}, ${picture.picture.mediaType}` : await noteOf(ann),
  );
  await ann.press('z');
}

/** Whoever only looks is told so at the tool. */
async function viewer(context) {
  const { ann, check } = context;
  const { page } = ann;
  // As an invite for viewers has it: the server gives less than the page asked for.
  await page.route('**/saccade.v1.SessionService/Join', async (route) => {
    const body = Buffer.from(route.request().postDataBuffer());
    await route.continue({ postData: asViewer(body) });
  });
  await page.evaluate(() => sessionStorage.clear());
  await page.reload();
  await tracked(context);
  await page.locator('nav button[data-control="cube"][aria-disabled="true"]').waitFor();
  await ann.press('c');
  await sleep(400);
  const reason = await page.locator('.tool .reason:not(:empty)').first().innerText();
  const current = await page.locator('nav button.current').getAttribute('data-control');
  await shot(context, 'viewer');
  check(
    'a viewer is told at the tool why not',
    /^You are a viewer/.test(reason) && current === 'select',
    `"${reason}"`,
  );
  await page.unroute('**/saccade.v1.SessionService/Join');
  await page.evaluate(() => sessionStorage.clear());
  await page.reload();
  await tracked(context);
  await page.locator('canvas.map[data-eye]').waitFor();
  await ann.enlarge('video');
}

/** A gRPC-Web frame of JoinRequest with the role (field 2) of a viewer. */
export function asViewer(body) {
  const message = body.subarray(5);
  const at = message.indexOf(Buffer.from([0x10, Role.EXPERT]));
  message[at + 1] = Role.VIEWER;
  return body;
}
