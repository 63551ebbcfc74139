// Everything of the page by keys alone, no mouse at all: who one is, the first task, every control, every dialog,
// the map, a frozen picture, the head, the list, talk, and the wearer's view.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService, AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { MapService } from '../../src/gen/saccade/v1/map_pb.js';
import { Role, SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { toneWav } from './audio_tap.mjs';
import { Expert } from './expert.mjs';
import { startServer } from './server.mjs';
import { listWhen, made, sleep, tracked } from './tools.mjs';
import { tabTo, tour } from './tour.mjs';

const HEARTBEAT_S = 5; // two busy cores

export async function runKeyboard({ server: binary, chromium, seed, shots, folder }) {
  const config = join(folder, 'keys.toml');
  writeFileSync(config, `[gaze]\nheartbeat_s = ${HEARTBEAT_S}.0\n`);
  const voice = join(folder, 'voice.wav');
  writeFileSync(voice, toneWav({ hz: 520 }));
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand&fps=10`, '--mount', 'sim'],
    ...['--config', config, '--data-dir', join(folder, 'keys-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots, url: server.http };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  context.toured = (name, { count, problems }) =>
    context.check(
      name,
      problems.length === 0,
      `${count} stops; ${problems.join('; ') || 'all reached, seen, free'}`,
    );
  try {
    const transport = createGrpcWebTransport({ baseUrl: server.http });
    context.annotations = createClient(AnnotationService, transport);
    context.session = createClient(SessionService, transport);
    context.map = createClient(MapService, transport);
    context.owner = (
      await context.session.join({ displayName: 'test', role: Role.EXPERT })
    ).sessionId;
    context.ann = await Expert.open(chromium, `${server.http}/`, {
      ...{ nameless: true, firstTime: true, prefix: ['nice', '-n', '5'] },
      flags: [
        '--use-fake-device-for-media-stream',
        '--use-fake-ui-for-media-stream',
        `--use-file-for-fake-audio-capture=${voice}`,
      ],
    });
    for (const step of [
      arrives,
      marks,
      wholePage,
      dialogs,
      mapByKeys,
      frozen,
      head,
      list,
      talk,
      wearer,
    ]) {
      await step(context);
    }
    const { errors } = context.ann;
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    await context.ann?.close();
    await server.stop();
  }
  return context.failures;
}

const type = (page, text) => page.keyboard.type(text, { delay: 5 });

/** Until it holds, or some seconds have gone. */
async function until(holds, timeoutMs = 8000) {
  for (const end = Date.now() + timeoutMs; Date.now() < end; await sleep(80)) {
    if (await holds()) return true;
  }
  return false;
}

async function arrives(context) {
  const { ann, check, toured } = context;
  const { page } = ann;
  await page.locator('dialog[open] #own-name').waitFor({ timeout: 30_000 });
  toured('dialog of the name', await tour(page));
  await tabTo(page, '#own-name');
  await type(page, 'Kay');
  await ann.press('Enter');
  await page.locator('canvas.map[data-eye]').waitFor();
  await tracked(context);
  const task = page.locator('.first-task:not(.hidden)');
  await task.waitFor({ timeout: 15_000 });
  const there = await tabTo(page, '.first-task button');
  await ann.press('Enter');
  const skipped = await until(async () => (await task.count()) === 0);
  check('the first task is skipped by keys', there && skipped, there ? 'reached' : 'not reached');
}

/** A note, a check list and a cube, by keys in the video. */
async function marks(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('s');
  const there = await tabTo(page, '.video');
  await ann.press('n');
  context.note = await made(context, AnnotationShape.NOTE, async () => {
    await tabTo(page, '.video');
    await ann.press('Enter');
    await type(page, 'by keys');
    await ann.press('Enter');
  });
  await ann.press('j');
  context.list = await made(context, AnnotationShape.CHECK_LIST, async () => {
    await tabTo(page, '.video');
    for (let i = 0; i < 4; ++i) await ann.press('Shift+ArrowLeft');
    await ann.press('Enter');
    await page.locator('dialog[open] #list-title').waitFor({ timeout: 6000 });
    await type(page, 'Pump');
    await ann.press('Tab');
    await type(page, 'valve');
    await ann.press('Control+Enter');
  });
  await until(async () => (await page.locator('dialog[open]').count()) === 0);
  await ann.press('v');
  check(
    'marks are placed by keys from the pane that Tab reached',
    there && context.note && context.list,
    `${context.note?.text ?? 'no note'}, ${context.list?.text ?? 'no list'}`,
  );
}

async function wholePage({ ann, toured }) {
  const { page } = ann;
  await ann.press('9'); // opens talk
  await ann.press('Escape');
  for (const [width, height] of [
    [1280, 720],
    [640, 360],
  ]) {
    await page.setViewportSize({ width, height });
    await sleep(600);
    toured(`the page at ${width} x ${height}`, await tour(page));
    for (const sheet of ['marks', 'gaze', 'talk']) {
      if (!(await page.locator(`button[data-sheet="${sheet}"]`).isVisible())) continue;
      await tabTo(page, `button[data-sheet="${sheet}"]`);
      await ann.press('Enter');
      await sleep(400);
      toured(`the sheet of ${sheet} at ${width} x ${height}`, await tour(page));
      await tabTo(page, `button[data-sheet="${sheet}"]`);
      await ann.press('Enter');
      await sleep(300);
    }
  }
  await page.setViewportSize({ width: 1280, height: 720 });
  await sleep(400);
}

/** Each opens by a key, keeps the keyboard while it is open, and gives it back where it was. */
async function dialogs(context) {
  const { ann, check, toured } = context;
  const { page } = ann;
  const open = page.locator('dialog[open]');
  const each = async (name, begin) => {
    await tracked(context);
    await tabTo(page, '.video');
    await begin();
    await open.waitFor({ timeout: 8000 });
    toured(`dialog of ${name}`, await tour(page));
    await ann.press('Escape');
    const shut = await until(async () => (await open.count()) === 0);
    const back = await page.evaluate(() => document.activeElement?.matches('.video') ?? false);
    check(
      `dialog of ${name} closes by Escape and gives the keyboard back`,
      shut && back,
      `${shut}, ${back}`,
    );
    await ann.press('v');
  };
  await each('help', () => ann.press('?'));
  await each('a check list', async () => {
    await ann.press('j');
    await ann.press('Enter');
  });
  await each('a picture', async () => {
    await ann.press('u');
    await ann.press('Enter');
  });
  await ann.press('r');
  const asks = page.locator('.confirm:not(.hidden)');
  await asks.waitFor();
  const onKeep = await page.evaluate(() => document.activeElement?.textContent ?? '');
  await ann.press('Escape');
  const kept = await until(async () => (await asks.count()) === 0);
  await ann.press('r');
  await asks.waitFor();
  await ann.press('Shift+Tab');
  const onReset = await page.evaluate(() => document.activeElement?.textContent ?? '');
  await ann.press('Escape');
  check(
    'whether to reset the map is asked and answered by keys',
    /^Keep/.test(onKeep) && kept && onReset === 'Reset',
    `first on "${onKeep}", Shift Tab to "${onReset}"`,
  );
}

async function mapByKeys(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.enlarge('map');
  const there = await tabTo(page, '.map3d');
  const eye = () => page.locator('canvas.map').getAttribute('data-eye');
  const moves = [];
  for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', '-', 'h']) {
    const before = await eye();
    await ann.press(key);
    if (await until(async () => (await eye()) !== before, 4000)) moves.push(key);
  }
  await sleep(800);
  await ann.press('c');
  const cube = await made(context, AnnotationShape.CUBE, async () => {
    await tabTo(page, '.map3d');
    await ann.press('Enter');
  });
  await ann.press('v');
  check(
    'the map is moved and clicked by keys',
    there && moves.length >= 5 && cube,
    `${moves.join(' ')}; ${cube ? 'a cube' : 'no cube'}`,
  );
}

async function frozen(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.enlarge('video');
  await tracked(context);
  await ann.press('p');
  const still = page.locator('canvas.still');
  const froze = await still.waitFor({ timeout: 8000 }).then(
    () => true,
    () => false,
  );
  await ann.press('c');
  const cube = await made(context, AnnotationShape.CUBE, async () => {
    await tabTo(page, '.video');
    await ann.press('Shift+ArrowDown');
    await ann.press('Enter');
  });
  await ann.press('v');
  await ann.press('p');
  const thawed = await until(async () => (await still.count()) === 0);
  const download = page.waitForEvent('download', { timeout: 10_000 });
  await ann.press('k');
  const kept = await download.then(
    (file) => file.suggestedFilename(),
    () => 'none',
  );
  check(
    'the picture is frozen, clicked, freed and kept by keys',
    froze && cube && thawed && /png$/.test(kept),
    `${cube ? 'a cube' : 'no cube'}, ${kept}`,
  );
}

/** What the panel says the head does and who steers: not its buttons, whose words are always there. */
async function head(context) {
  const { ann, check } = context;
  const { page } = ann;
  const panel = page.locator('section.gaze');
  const says = async () =>
    `${await panel.getAttribute('data-mode')} | ${await panel.locator('.doing').innerText()} | ${await panel.locator('.steer').innerText()}`;
  const seen = [];
  const does = async (key, pattern) => {
    const before = await says();
    await ann.press(key);
    const done = await until(async () => pattern.test(await says()), 12_000);
    if (done && !pattern.test(before)) seen.push(key);
    else console.log(`      ${key}: "${before}", then "${await says()}"`);
  };
  await tracked(context);
  await does('q', /you pilot/);
  await ann.press('g');
  await tabTo(page, '.video');
  await does('Enter', /turning to|holding|following|out of reach/);
  await ann.press('v');
  await does('x', /stopped/);
  await does('0', /straight ahead|at rest/);
  await does('e', /looking round/);
  await does('l', /level/);
  await does('q', /nobody pilots/);
  check(
    'the head is taken, turned, stopped and released by keys',
    seen.length === 7,
    `${seen.join(' ')}; "${(await says()).replaceAll('\n', ' ')}"`,
  );
}

async function list(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('Escape');
  await ann.press('/');
  await type(page, 'by keys');
  const found = await until(async () => (await page.locator('aside li').count()) === 1);
  await ann.press('Enter');
  const there = await tabTo(page, 'aside li .pick');
  await ann.press('Enter');
  await page.locator('aside li.selected').waitFor();
  await ann.press('F2');
  await page
    .locator('.note-editor textarea, .note-editor input, aside textarea')
    .first()
    .waitFor({ timeout: 5000 })
    .catch(() => undefined);
  await ann.press('Control+a');
  await type(page, 'by keys, changed');
  await ann.press('Enter');
  const changed = await listWhen(context, (all) =>
    all.find(({ text }) => text === 'by keys, changed'),
  );
  await ann.press('/');
  await ann.press('Escape');
  await tabTo(page, `aside li[data-id="${context.list?.id}"] input[type="checkbox"]`);
  await ann.press(' ');
  const ticked = await listWhen(context, (all) =>
    all.find(({ checkItems }) => checkItems[0]?.done),
  );
  const count = await page.locator('aside li').count();
  await tabTo(page, 'aside li .remove');
  await ann.press('Enter');
  const removed = await until(async () => (await page.locator('aside li').count()) === count - 1);
  await ann.press('z');
  const back = await until(async () => (await page.locator('aside li').count()) === count);
  check(
    'marks are found, selected, changed, ticked off, deleted and brought back by keys',
    found && there && changed && ticked && removed && back,
    `${[found, there, Boolean(changed), Boolean(ticked), removed, back].join()}`,
  );
}

async function talk(context) {
  const { ann, check } = context;
  const { page } = ann;
  await ann.press('Escape');
  await tabTo(page, 'aside li .pick');
  await ann.press('Enter');
  await page.locator('aside li.selected').waitFor();
  await ann.press('9');
  await type(page, 'look');
  await page.keyboard.press('Shift+Tab');
  await ann.press(' '); // the mark goes with it
  await ann.press('Tab');
  await ann.press('Enter');
  const carried = page.locator('section.talk li .look-here');
  const said = await until(async () => (await carried.count()) > 0);
  await ann.press('Escape');
  await tabTo(page, 'section.talk li .look-here');
  await ann.press('Enter');
  const words = () => page.locator('section.talk .voice-words').innerText();
  const heard = [];
  for (const [key, pattern] of [
    ['8', /are heard|hear the others/],
    ['7', /muted/],
    ['7', /are heard/],
    ['8', /^$/],
  ]) {
    await ann.press(key);
    if (await until(async () => pattern.test(await words()), 15_000)) heard.push(key);
  }
  const name = await tabTo(page, 'header input.name');
  await ann.press('Control+a');
  await type(page, 'Kim');
  await ann.press('Enter');
  const known = await until(async () => {
    const { presence } = await context.session.getStatus({});
    return presence.participants.some(
      ({ displayName, name: called }) => (displayName ?? called) === 'Kim',
    );
  });
  check(
    'messages, voices and the own name by keys',
    said && heard.length === 4 && name && known,
    `${said ? 'a message with its mark' : 'no message'}; voice ${heard.join(' ')}; ${known ? 'renamed' : 'not renamed'}`,
  );
}

async function wearer(context) {
  const { ann, check, toured } = context;
  const { page } = ann;
  await page.goto(`${context.url}/wearer`);
  await page.locator('canvas.picture[data-frame-id]').waitFor({ timeout: 30_000 });
  await sleep(1500);
  toured('the wearer’s view', await tour(page));
  const paused = page.locator('.wearer-view.paused');
  await tabTo(page, 'button.pause');
  await ann.press('Enter');
  const stops = await until(async () => (await paused.count()) === 1);
  await ann.press('p');
  const goesOn = await until(async () => (await paused.count()) === 0);
  check(
    'the wearer pauses the picture and goes on by keys',
    stops && goesOn,
    `${stops}, ${goesOn}`,
  );
}
