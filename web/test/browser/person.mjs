// A person at the page: what is typed is text, what is clicked is done once, what is told is true; several
// tabs, and a page that is loaded anew. The server answers late here, as it does over a network.
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService } from '../../src/gen/saccade/v1/annotation_pb.js';
import { GazeService } from '../../src/gen/saccade/v1/gaze_pb.js';
import { Expert } from './expert.mjs';
import { checkMarks } from './marks.mjs';
import { startServer } from './server.mjs';

const LATE_MS = 400; // a server across the ocean, or a busy one
const CREATE = '**/saccade.v1.AnnotationService/Create';
const LONG =
  'Größe prüfen ≈ 5 mm, dann die dritte Schraube von links lösen, nicht die vierte. '.repeat(5);

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runPerson({ server: binary, chromium, seed, shots, folder }) {
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand`, '--mount', 'sim'],
    ...['--data-dir', join(folder, 'person-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots, url: server.http };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.annotations = createClient(AnnotationService, transport);
    context.gaze = createClient(GazeService, transport);
    context.expert = await Expert.open(chromium, `${server.http}/?name=Ann`);
    await context.expert.waitForStatus(/^tracking/, 60_000);
    await context.expert.page.locator('.app[data-first-picture-ms]').waitFor();
    await context.expert.enlarge('video');
    await typing(context);
    await refusal(context);
    await emptyCorner(context);
    await wholeText(context);
    await checkMarks(context);
    await buttons(context);
    await reload(context);
    await manyTabs(context);
    const { errors } = context.expert;
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    await context.expert?.close();
    await server.stop();
  }
  return context.failures;
}

async function shot({ shots, expert }, name) {
  if (shots) await expert.page.screenshot({ path: join(shots, `${name}.png`) });
}

const listOf = async ({ annotations }) => (await annotations.list({})).annotations;
const textsOf = async (context) => (await listOf(context)).map(({ text }) => text);

/** Waits until the server's texts are as wanted; what they were last. */
async function textsWhen(context, wanted, timeoutMs = 5000) {
  for (const end = Date.now() + timeoutMs; ; await sleep(50)) {
    const texts = await textsOf(context);
    if (wanted(texts) || Date.now() > end) return texts;
  }
}

/** Everything that a stray key would have changed. */
async function untouched({ expert, gaze }) {
  const page = await expert.page.evaluate(() => ({
    main: document.querySelector('main').dataset.main,
    frozen: document.querySelector('.video.frozen') !== null,
    fast: document.querySelector('[data-control="fast"]').getAttribute('aria-pressed'),
    follow: document.querySelector('[data-control="follow"]').getAttribute('aria-pressed'),
    confirming: document.querySelector('.confirm:not(.hidden)') !== null,
    help: document.querySelector('dialog').open,
  }));
  const { state } = await gaze.getState({});
  return JSON.stringify({ ...page, pilot: state.pilot?.displayName ?? 'nobody', mode: state.mode });
}

const editorText = ({ expert }) => expert.page.locator('.note-editor textarea').inputValue();
const editorOpen = ({ expert }) => expert.page.locator('.note-editor:not(.hidden)').isVisible();

/** A place in the picture, as shares of it, that nothing lies over. */
async function placeIn({ expert }, x, y) {
  const { left, top, scale, width, height } = await expert.look();
  return [left + x * width * scale, top + y * height * scale];
}

/** Answers to Create come late; gives back how to end that. */
async function answerLate({ expert }) {
  await expert.page.route(CREATE, async (route) => {
    await sleep(LATE_MS);
    await route.continue();
  });
  return () => expert.page.unroute(CREATE);
}

async function typing(context) {
  const { expert, check } = context;
  const before = await untouched(context);
  const prompt = await answerLate(context);
  await expert.press('n');
  await expert.click(await placeIn(context, 0.4, 0.4));
  await expert.page.keyboard.type('stop here');
  const typed = await editorText(context).catch(() => 'no editor');
  const after = await untouched(context);
  check(
    'keys typed with the click are text, and drive nothing',
    typed === 'stop here' && after === before,
    `"${typed}"; ${after === before ? 'nothing changed' : `${before} became ${after}`}`,
  );
  // The focus goes astray: the keys still mean the note.
  await expert.page.evaluate(() => document.activeElement.blur());
  await expert.page.keyboard.type(' next');
  const astray = [await editorText(context).catch(() => 'no editor'), await untouched(context)];
  check(
    'so they are when the focus was lost',
    astray[0] === 'stop here next' && astray[1] === before,
    `"${astray[0]}"`,
  );
  await shot(context, 'note-typing');
  await expert.press('Enter');
  const kept = await textsWhen(context, (texts) => texts.length > 0);
  check('Enter keeps it, once', kept.join() === 'stop here next', kept.join(' | '));

  await expert.click(await placeIn(context, 0.55, 0.4));
  await expert.page.keyboard.type('sxe never mind');
  await expert.press('Escape');
  await sleep(2 * LATE_MS + 500);
  const left = await textsOf(context);
  check(
    'Escape leaves no note, blank or not',
    left.length === 1 && !(await editorOpen(context)),
    left.join(' | '),
  );

  // An input method takes Enter and Escape for itself while it composes.
  await expert.click(await placeIn(context, 0.5, 0.3));
  const cdp = await expert.context.newCDPSession(expert.page);
  const composed = { text: 'けんさ', selectionStart: 3, selectionEnd: 3 };
  for (const key of ['Enter', 'Escape']) {
    await cdp.send('Input.imeSetComposition', composed);
    await expert.press(key);
  }
  const open = await editorOpen(context);
  await cdp.send('Input.insertText', { text: '検査' });
  const written = open ? await editorText(context) : 'no editor';
  check('an input method is left alone', open && written.includes('検査'), `"${written}"`);
  await expert.page.locator('.note-editor textarea').fill('');
  await expert.page.keyboard.type('only one');
  await expert.click(await placeIn(context, 0.3, 0.55));
  await sleep(2 * LATE_MS + 500);
  const one = await textsOf(context);
  check(
    'a click elsewhere finishes the note, and places no other',
    one.length === 2 && one.includes('only one') && !(await editorOpen(context)),
    one.join(' | '),
  );

  await expert.click(await placeIn(context, 0.5, 0.5));
  await expert.page.keyboard.insertText('ä'.repeat(251));
  await expert.press('Enter');
  const room = await expert.page.locator('.note-editor .line .number').innerText();
  await sleep(LATE_MS + 300);
  const still = await editorText(context).catch(() => '');
  check(
    'too long is said in bytes, and nothing is cut',
    room.startsWith('2 bytes too long') &&
      still.length === 251 &&
      (await textsOf(context)).length === 2,
    `"${room}", ${still.length} characters kept`,
  );
  await expert.press('Escape');
  await prompt();
}

async function refusal(context) {
  const { expert, check } = context;
  const before = await textsOf(context);
  await expert.page.route(CREATE, (route) => route.abort());
  await expert.click(await placeIn(context, 0.45, 0.6));
  await expert.page.keyboard.type('worth keeping');
  await expert.press('Enter');
  const problem = expert.page.locator('.note-editor .problem');
  await problem.filter({ hasText: /^Not placed/ }).waitFor({ timeout: 8000 });
  const [kept, words] = [await editorText(context), await problem.innerText()];
  await shot(context, 'note-refused');
  await expert.page.unroute(CREATE);
  await expert.press('Enter');
  const after = await textsWhen(context, (texts) => texts.length > before.length);
  check(
    'a refused note keeps its text, and can be tried again',
    kept === 'worth keeping' && after.filter((text) => text === kept).length === 1,
    `"${kept}": ${words}`,
  );
}

async function emptyCorner(context) {
  const { expert, check } = context;
  await expert.enlarge('map');
  await expert.press('h');
  await sleep(500);
  const before = (await listOf(context)).length;
  const box = await expert.page.locator('.map3d').boundingBox();
  const corner = [box.x + 25, box.y + 60];
  await expert.press('c');
  await expert.click(corner);
  await sleep(800);
  const note = await expert.page.locator('.map3d .pane-note').innerText();
  const state = await untouched(context);
  await expert.press('n');
  await expert.click(corner);
  await expert.page.keyboard.type('sex');
  const typed = await editorText(context).catch(() => 'no editor');
  const problem = await expert.page.locator('.note-editor .problem').innerText();
  await shot(context, 'empty-corner');
  await expert.press('Escape');
  await expert.press('v');
  const count = (await listOf(context)).length;
  check(
    'an empty corner of the map is refused in words, and what is typed then is text',
    count === before &&
      note.startsWith('Not placed') &&
      typed === 'sex' &&
      (await untouched(context)) === state,
    `${count - before} placed: "${note}"; note "${typed}": ${problem}`,
  );
  await expert.enlarge('video');
}

/** All of a long text can be read on the page. */
async function wholeText(context) {
  const { expert, check } = context;
  await expert.press('n');
  await expert.click(await placeIn(context, 0.4, 0.7));
  await expert.page.keyboard.insertText(LONG);
  await expert.press('Enter');
  await textsWhen(context, (texts) => texts.includes(LONG.trim()));
  await expert.press('v');
  const row = expert.page.locator('aside li.selected');
  await row.waitFor({ timeout: 5000 });
  const title = await row.locator('.title').evaluate((element) => ({
    text: element.textContent,
    cut: element.scrollWidth > element.clientWidth + 1,
  }));
  await sleep(500);
  await shot(context, 'whole-text');
  check(
    'the row of a long note says all of it',
    title.text === LONG.trim() && !title.cut,
    `${title.text.length} characters${title.cut ? ', cut' : ''}`,
  );
  await expert.press('Delete');
}

/** What a click did, Space and Enter do not do again. */
async function buttons(context) {
  const { expert, check } = context;
  await expert.page.locator('[data-control="fast"]').click();
  await expert.press('Space');
  await expert.press('Enter');
  await sleep(1000); // and shown
  const fast = await expert.page.locator('[data-control="fast"]').getAttribute('aria-pressed');
  await expert.page.locator('[data-control="fast"]').click();
  const wearer = await expert.context.newPage();
  await wearer.goto(`${context.url}/wearer`);
  const stop = wearer.getByRole('button', { name: 'Stop the head' });
  await stop.waitFor({ timeout: 30_000 });
  await stop.click();
  const go = wearer.getByRole('button', { name: 'Let the head move' });
  await go.waitFor({ timeout: 5000 });
  await wearer.keyboard.press('Space');
  await wearer.keyboard.press('Enter');
  await sleep(600);
  const { paused } = (await context.gaze.getState({})).state;
  await wearer.getByRole('button', { name: 'Pause picture' }).click();
  await wearer.keyboard.press('Space');
  await sleep(300);
  const held = await wearer.getByRole('button', { name: 'Go on' }).isVisible();
  if (context.shots) await wearer.screenshot({ path: join(context.shots, 'wearer.png') });
  check(
    "Space after a click on one of the wearer's buttons does not press it again",
    paused && held && fast === 'true',
    `head ${paused ? 'stopped' : 'moves again'}, picture ${held ? 'held' : 'goes on'}, fast ${fast}`,
  );
  await wearer.getByRole('button', { name: 'Go on' }).click(); // it was paused for everybody
  await wearer.getByRole('button', { name: 'Pause picture' }).waitFor({ timeout: 5000 });
  await go.click();
  await wearer.close();
}

/** A reload keeps what can be undone; a duplicate of the tab gets a session of its own. */
async function reload(context) {
  const { expert, check } = context;
  const session = () =>
    expert.page.evaluate(() => sessionStorage.getItem('saccade.session.expert'));
  await expert.press('c');
  const before = await expert.annotationIds();
  await expert.click(await placeIn(context, 0.45, 0.35));
  const { id, refused } = await expert.newAnnotation(before);
  const kept = await session();
  await expert.page.reload();
  await expert.waitForStatus(/^tracking/, 30_000);
  await expert.page.locator(`aside li[data-id="${id}"]`).waitFor({ timeout: 10_000 });
  await expert.press('z');
  let gone = false;
  for (const end = Date.now() + 5000; !gone && Date.now() < end; await sleep(50)) {
    gone = !(await listOf(context)).some((annotation) => annotation.id === id);
  }
  check(
    'after a reload what was done before it can be undone',
    !refused && gone && (await session()) === kept,
    refused ?? (gone ? 'undone' : 'still there'),
  );
  // As "Duplicate" does: another tab that begins with the same storage.
  const twin = await expert.context.newPage();
  await twin.addInitScript((value) => {
    if (!sessionStorage.getItem('saccade.session.expert')) {
      sessionStorage.setItem('saccade.session.expert', value);
    }
  }, kept);
  await twin.goto(`${context.url}/?name=Ann`);
  await twin.locator('.app[data-link="live"]').waitFor({ timeout: 15_000 });
  await sleep(3000);
  const own = await twin.evaluate(() => sessionStorage.getItem('saccade.session.expert'));
  const links = [
    await twin.locator('.app').getAttribute('data-link'),
    await expert.page.locator('.app').getAttribute('data-link'),
  ];
  check(
    'a duplicated tab has a session of its own, and both go on',
    own !== kept && (await session()) === kept && links.join() === 'live,live',
    `${links.join(', ')}, sessions ${own === kept ? 'shared' : 'apart'}`,
  );
  await twin.close();
}

/** Six tabs: four go on, the others say why they do not, and do once there is room. */
async function manyTabs(context) {
  const { expert, check } = context;
  const others = [];
  for (let i = 0; i < 5; ++i) {
    const page = await expert.context.newPage();
    await page.setViewportSize({ width: 400, height: 300 });
    await page.goto(`${context.url}/wearer`);
    others.push(page);
    await sleep(1500);
  }
  const words = () =>
    Promise.all(others.map((page) => page.locator('.wearer-view .line').textContent()));
  const crowded = (text) => /too many tabs/.test(text);
  const said = await words();
  // The oldest still has its connections: an edit is answered at once.
  await expert.page.bringToFront();
  await expert.press('c');
  const before = await expert.annotationIds();
  const begin = performance.now();
  await expert.click(await placeIn(context, 0.5, 0.4));
  const { id, refused } = await expert.newAnnotation(before);
  const tookMs = performance.now() - begin;
  await shot(context, 'many-tabs');
  if (context.shots) await others[4].screenshot({ path: join(context.shots, 'crowded.png') });
  check(
    'with six tabs the older ones work, and the newer ones say why they do not',
    said.filter(crowded).length === 2 &&
      crowded(said[3]) &&
      crowded(said[4]) &&
      Boolean(id) &&
      tookMs < 3000,
    `${said.filter(crowded).length} say so; a mark ${refused ?? `after ${tookMs.toFixed(0)} ms`}`,
  );
  await others[0].close();
  let on = false;
  for (const end = Date.now() + 15_000; !on && Date.now() < end; await sleep(200)) {
    on = !crowded(await others[3].locator('.wearer-view .line').textContent());
  }
  const last = crowded(await others[4].locator('.wearer-view .line').textContent());
  check('one closed, the next goes on', on && last, on ? 'goes on' : 'does not');
  for (const page of others.slice(1)) await page.close();
}
