// Every tool once by the keyboard alone: a key, arrows, Enter.
import { AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { barriers } from './axe.mjs';
import { samplePng } from './files.mjs';
import { listOf, listWhen, made, noteOf, opened, shot, sleep, tracked } from './tools.mjs';

export async function byKeyboard(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('v');
  await ann.press('Escape');
  await page.locator('.video').focus();
  const arrows = async (key, count) => {
    for (let i = 0; i < count; ++i) await ann.press(key);
  };
  const done = [];
  const missed = [];
  const note = (name, mark) => (mark ? done : missed).push(name);

  for (const [name, key, shape] of [
    ['cube', 'c', AnnotationShape.CUBE],
    ['box', 'b', AnnotationShape.BOX],
    ['arrow', 'a', AnnotationShape.ARROW],
    ['pin', '1', AnnotationShape.PIN],
  ]) {
    await ann.press(key);
    await arrows('ArrowLeft', 3);
    note(name, await made(context, shape, () => ann.press('Enter')));
  }
  await ann.press('n');
  note(
    'note',
    await made(context, AnnotationShape.NOTE, async () => {
      await ann.press('Enter');
      await page.keyboard.type('by keys');
      await ann.press('Enter');
    }),
  );
  await page.locator('.video').focus();
  await ann.press('d');
  note(
    'measure',
    await made(context, AnnotationShape.MEASURE, async () => {
      await ann.press('Enter');
      await arrows('ArrowRight', 12);
      await ann.press('Enter');
    }),
  );
  await ann.press('i');
  note(
    'ink',
    await made(context, AnnotationShape.INK, async () => {
      await page.locator('.video').focus();
      await ann.press('Enter');
      await arrows('ArrowUp', 6);
      await arrows('ArrowRight', 6);
      await ann.press('Enter');
    }),
  );
  await ann.press('j');
  note(
    'check list',
    await made(context, AnnotationShape.CHECK_LIST, async () => {
      await opened(context, '#list-title', () => ann.press('Enter'));
      await page.keyboard.type('Keys');
      await ann.press('Tab');
      await page.keyboard.type('one');
      await ann.press('Enter');
      await page.keyboard.type('two');
      await ann.press('Control+Enter');
    }),
  );
  // The mark is there before its dialog has heard of it.
  const free = () => page.waitForFunction(() => !document.querySelector('dialog[open]'));
  await free();
  await page.locator('.video').focus();
  await ann.press('u');
  note(
    'picture',
    await made(context, AnnotationShape.PICTURE, async () => {
      // Before anything is pressed: a quick page asks the system for a file before the browser is told not to.
      const chooser = page.waitForEvent('filechooser', { timeout: 60_000 });
      await opened(context, '#picture-file', () => ann.press('Enter'));
      await page.waitForFunction(() => document.activeElement?.id === 'picture-file');
      await ann.press('Enter');
      await (await chooser).setFiles(samplePng(context.folder));
      await page.locator('dialog[open] .preview canvas').waitFor({ timeout: 15_000 });
      await page.locator('#picture-text').focus();
      await ann.press('Enter');
    }),
  );
  check(
    'each tool that makes a mark does so by keys alone',
    missed.length === 0,
    `${done.join(', ')}${missed.length > 0 ? `; not ${missed.join(', ')}: ${await noteOf(ann)}` : ''}`,
  );

  await free();
  await laserByKeys(context);
  await turnByKeys(context);
  await areaByKeys(context);
  await ann.press('?');
  await page.locator('dialog[open]').waitFor();
  const found = await barriers(page);
  check('help with all the keys, axe', found.length === 0, found.join('; ') || 'none');
  await shot(context, 'help');
  await ann.press('Escape');
  // Every button says its key.
  const silent = await page
    .locator('nav button[data-control]')
    .evaluateAll((all) => all.filter((each) => !each.querySelector('kbd')?.textContent).length);
  check('every tool shows its key', silent === 0, `${silent} do not`);
}

/** What is drawn of others on a page's video, as it says. */
export const pointersOn = (page) =>
  page.locator('.video canvas.pointers').evaluate((canvas) => canvas.dataset.pointers ?? '');

async function laserByKeys(context) {
  const { ann, bo, check } = context;
  await ann.page.locator('.video').focus();
  await ann.press('w');
  await ann.press('Enter');
  await ann.press('ArrowRight');
  let seen = '';
  for (const end = Date.now() + 5000; !seen && Date.now() < end; await sleep(50)) {
    seen = await pointersOn(bo.page);
  }
  await ann.press('Enter');
  let left = seen;
  for (const end = Date.now() + 5000; left && Date.now() < end; await sleep(50)) {
    left = await pointersOn(bo.page);
  }
  check(
    'the laser is held from Enter to Enter',
    /^Ann laser/.test(seen) && left === '',
    `"${seen}", then "${left}"; ${await noteOf(ann)}`,
  );
  await ann.press('v');
}

async function turnByKeys(context) {
  const { ann, check } = context;
  await ann.page.locator('.video').focus();
  await ann.press('a');
  const arrow = await made(context, AnnotationShape.ARROW, () => ann.press('Enter'));
  await ann.page.locator(`aside li.selected[data-id="${arrow?.id}"]`).waitFor();
  await ann.press('v');
  for (let i = 0; i < 3; ++i) await ann.press('.');
  await ann.press('Shift+>');
  const turned = await listWhen(context, (all) =>
    all.find(({ id, worldFromMark: q }) => id === arrow?.id && q && q.w < 0.99),
  );
  check(
    'an arrow is turned and tipped by keys, in one change',
    turned?.revision === arrow.revision + 1n,
    turned ? `w ${turned.worldFromMark.w.toFixed(3)}` : await noteOf(ann),
  );
}

async function areaByKeys(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('Escape');
  // In a picture that stands still: a loaded computer loses the camera, and then there are no marks to select.
  await tracked(context);
  await ann.press('p');
  await page.locator('canvas.still').waitFor();
  await page.locator('.video').focus();
  await ann.press('2');
  for (let i = 0; i < 12; ++i) await ann.press('Shift+ArrowLeft');
  for (let i = 0; i < 12; ++i) await ann.press('Shift+ArrowUp');
  await ann.press('Enter');
  for (let i = 0; i < 20; ++i) await ann.press('Shift+ArrowRight');
  for (let i = 0; i < 20; ++i) await ann.press('Shift+ArrowDown');
  await ann.press('Enter');
  let byArea = 0;
  for (const end = Date.now() + 8000; byArea <= 2 && Date.now() < end; await sleep(100)) {
    byArea = await page.locator('aside li.selected').count();
  }
  const said = await noteOf(ann);
  await ann.press('v');
  await ann.press('p');
  await ann.press('Escape');
  await ann.press('Control+a');
  await sleep(500);
  const all = await page.locator('aside li.selected').count();
  await ann.press('Escape');
  const count = (await listOf(context)).length;
  check(
    'several marks are selected by keys',
    byArea > 2 && all === count,
    `${byArea} in a rectangle, ${all} of ${count} by Ctrl A; ${said}`,
  );
}
