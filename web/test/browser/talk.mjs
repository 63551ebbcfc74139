// Two people talk: voices through real Chromiums with fake microphones, messages that carry a mark, the
// wearer's large pause as both see it, and the first task of who comes for the first time.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { SessionService } from '../../src/gen/saccade/v1/session_pb.js';
import { delays, tapAudio, toneWav } from './audio_tap.mjs';
import { Expert } from './expert.mjs';
import { barriers } from './axe.mjs';
import { startServer } from './server.mjs';

const VOICE_S = 30;
const DELAY_MS = 400; // p95, on a computer that also draws two pages, tracks and simulates
const LOSS = 0.05;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const quantile = (values, q) =>
  [...values].sort((a, b) => a - b)[Math.floor(q * (values.length - 1))] ?? NaN;

const microphone = (folder, name, hz) => {
  const file = join(folder, `${name}.wav`);
  writeFileSync(file, toneWav({ hz }));
  return [
    '--use-fake-device-for-media-stream',
    '--use-fake-ui-for-media-stream',
    `--use-file-for-fake-audio-capture=${file}`,
    '--autoplay-policy=no-user-gesture-required',
  ];
};

export async function runTalk({ server: binary, chromium, seed, shots, folder }) {
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=sway&width=320&height=240`, '--mount', 'sim'],
    ...['--data-dir', join(folder, 'talk-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  try {
    context.session = createClient(
      SessionService,
      createGrpcWebTransport({ baseUrl: server.http }),
    );
    context.ann = await Expert.open(chromium, `${server.http}/?name=Ann`, {
      flags: microphone(folder, 'ann', 520),
      init: tapAudio,
      firstTime: true,
    });
    await context.ann.waitForStatus(/^tracking/, 60_000);
    await firstTask(context);
    context.wim = await Expert.open(chromium, `${server.http}/wearer`, {
      flags: microphone(folder, 'wim', 700),
      init: tapAudio,
      viewport: { width: 960, height: 720 },
    });
    await context.wim.page.locator('canvas.picture[data-frame-id]').waitFor({ timeout: 30_000 });
    await voices(context);
    await messages(context);
    await pause(context);
    for (const [name, { errors }] of Object.entries({ ann: context.ann, wim: context.wim })) {
      context.check(`page errors, ${name}`, errors.length === 0, errors.join('; ') || 'none');
    }
  } finally {
    await context.ann?.close();
    await context.wim?.close();
    await server.stop();
  }
  return context.failures;
}

async function shot({ shots }, expert, name) {
  if (shots) await expert.page.screenshot({ path: join(shots, `talk-${name}.png`) });
}

async function axe({ check }, expert, name) {
  const found = await barriers(expert.page);
  check(`${name}, axe`, found.length === 0, found.join('; ') || 'none');
}

/** A note, a frozen picture, a look round; and never again. */
async function firstTask(context) {
  const { ann, check } = context;
  const { page } = ann;
  const card = page.locator('.first-task');
  const says = (text) => card.filter({ hasText: text }).waitFor({ timeout: 15_000 });
  await card.waitFor({ timeout: 20_000 });
  await page.locator('canvas.map[data-eye]').waitFor();
  await axe(context, ann, 'first task');
  await shot(context, ann, 'first-task');
  const named = await page.locator('nav button.unused').count();
  await ann.enlarge('video');
  const box = await page.locator('.video').boundingBox();
  for (let tries = 0; tries < 5; ++tries) {
    await ann.press('n');
    await ann.click([box.x + 0.55 * box.width, box.y + 0.6 * box.height]);
    await page.keyboard.type('mug');
    await ann.press('Enter');
    const placed = await says('2 of 3').then(
      () => true,
      () => false,
    );
    if (placed) break;
    await ann.press('Escape'); // whatever was typed: the next try begins anew
  }
  await ann.press('v');
  await ann.press('p');
  await says('3 of 3');
  await ann.enlarge('map');
  const map = await page.locator('.map3d').boundingBox();
  await page.mouse.move(map.x + 0.5 * map.width, map.y + 0.5 * map.height);
  await page.mouse.down();
  await page.mouse.move(map.x + 0.7 * map.width, map.y + 0.55 * map.height, { steps: 5 });
  await page.mouse.up();
  await says('Well done');
  await card.getByRole('button', { name: 'Close' }).click();
  await ann.press('p');
  const fewer = await page.locator('nav button.unused').count();
  check('tools are named until they are used', fewer < named, `${named}, then ${fewer}`);
  await page.reload();
  await ann.waitForStatus(/^tracking/, 60_000);
  await sleep(1000);
  const again = await card.isVisible();
  await ann.press('?');
  await page.getByRole('button', { name: 'Show the first task' }).click();
  const asked = await card.isVisible();
  await card.getByRole('button', { name: 'Skip' }).click();
  check(
    'the first task is offered once, and again when asked for',
    !again && asked && !(await card.isVisible()),
    `after a reload ${again ? 'again' : 'not'}, from the help ${asked ? 'again' : 'not'}`,
  );
}

/** Forgets onsets so far, waits, and says what was heard of whom. */
async function listen({ ann, wim }, seconds) {
  for (const { page } of [ann, wim]) {
    await page.evaluate(() => {
      window.onsets.microphone.length = window.onsets.played.length = 0;
    });
  }
  await sleep(1000 * seconds);
  const [a, w] = await Promise.all(
    [ann, wim].map(({ page }) => page.evaluate(() => window.onsets)),
  );
  // The last tone may still be on its way.
  return {
    'Ann to Wim': { spoken: a.microphone.slice(0, -1), heard: w.played },
    'Wim to Ann': { spoken: w.microphone.slice(0, -1), heard: a.played },
  };
}

const heardAt = async ({ page }, selector) => {
  const text = (await page.locator(selector).getAttribute('data-heard')) ?? '';
  const [played = 0, concealed = 0, late = 0, skipped = 0, delayMs = 0] = text
    .split(' ')
    .map(Number);
  return { played, concealed, late, skipped, delayMs };
};

async function voices(context) {
  const { ann, wim, check } = context;
  await ann.page.locator('.talk-head').click();
  await ann.press('8');
  await wim.press('v');
  await wim.page.getByRole('button', { name: 'Mute' }).waitFor({ timeout: 15_000 });
  await ann.page
    .locator('.voice button[aria-keyshortcuts="7"]:not(.hidden)')
    .waitFor({ timeout: 15_000 });
  // Two software GPUs on the cores that carry the voices as well: little is drawn meanwhile.
  await ann.page.setViewportSize({ width: 620, height: 420 });
  await wim.page.setViewportSize({ width: 400, height: 300 });
  await sleep(6000); // the microphones and the buffers settle
  const selectors = { ann: '.voice', wim: '.wearer-view' };
  let before = await heardAt(wim, selectors.wim);
  for (const [way, { spoken, heard }] of Object.entries(await listen(context, VOICE_S))) {
    const took = delays(spoken, heard);
    const [p50, p95] = [quantile(took, 0.5), quantile(took, 0.95)];
    check(
      `a tone from ${way}, ${VOICE_S} s`,
      took.length >= 0.9 * spoken.length && spoken.length > 20 && p95 < DELAY_MS,
      `delay p50 ${p50.toFixed(0)} ms, p95 ${p95.toFixed(0)} ms, ${took.length} of ${spoken.length} heard`,
    );
  }
  let after = await heardAt(wim, selectors.wim);
  console.log(
    `      without loss: ${after.played - before.played} frames played, ${after.concealed - before.concealed} concealed, ${after.late - before.late} late, buffer ${after.delayMs} ms`,
  );
  const lit = await ann.page.locator('.people .speaks').count();
  let seen = lit;
  for (let i = 0; i < 20 && seen === 0; ++i) {
    await sleep(100);
    seen = await ann.page.locator('.people .speaks').count();
  }
  check('the name of who speaks is lit', seen > 0, `${seen} lit`);
  await wim.page.evaluate((loss) => {
    document.documentElement.dataset.voiceLoss = String(loss);
  }, LOSS);
  before = await heardAt(wim, selectors.wim);
  const { 'Ann to Wim': lossy } = await listen(context, VOICE_S);
  after = await heardAt(wim, selectors.wim);
  await wim.page.evaluate(() => {
    delete document.documentElement.dataset.voiceLoss;
  });
  const took = delays(lossy.spoken, lossy.heard);
  const [played, concealed] = [after.played - before.played, after.concealed - before.concealed];
  const share = concealed / Math.max(played + concealed, 1);
  check(
    `with ${100 * LOSS} % of the packets lost, ${VOICE_S} s`,
    took.length >= 0.85 * lossy.spoken.length && share < 2 * LOSS,
    `delay p50 ${quantile(took, 0.5).toFixed(0)} ms, p95 ${quantile(took, 0.95).toFixed(0)} ms, ${took.length} of ${lossy.spoken.length} heard; ${concealed} of ${played + concealed} frames concealed (${(100 * share).toFixed(1)} %)`,
  );
  await mutes(context);
  await ann.page.setViewportSize({ width: 1280, height: 720 });
  await wim.page.setViewportSize({ width: 960, height: 720 });
}

/** The button may be folded away in a small window. */
const pushToTalk = ({ page }) =>
  page.evaluate(() => {
    const buttons = [...document.querySelectorAll('.voice button')];
    buttons.find(({ textContent }) => textContent === 'Push to talk').click();
  });

/** Muted, and with push to talk, nothing is heard; held, it is. */
async function mutes({ ann, wim, check }) {
  const heard = async (seconds) => {
    await sleep(2000); // what is on its way
    const before = (await heardAt(wim, '.wearer-view')).played;
    await sleep(1000 * seconds);
    return (await heardAt(wim, '.wearer-view')).played - before;
  };
  await ann.press('7');
  const muted = await heard(2);
  await ann.press('7');
  await pushToTalk(ann);
  const silent = await heard(2);
  await ann.page.keyboard.down(' ');
  const held = await heard(3);
  await ann.page.keyboard.up(' ');
  await pushToTalk(ann);
  check(
    'muted nothing is heard, nor with push to talk until Space is held',
    muted === 0 && silent === 0 && held > 30,
    `frames played: muted ${muted}, not held ${silent}, held ${held}`,
  );
}

async function messages(context) {
  const { ann, wim, check } = context;
  const { page } = ann;
  await wim.page.mouse.click(5, 5); // a page may sound once it was touched
  await page.locator('aside .pick').first().click();
  await ann.press('9');
  await page.keyboard.type('this one, please');
  await page.locator('.say .chip').focus();
  await page.keyboard.press('Enter');
  await page.locator('.say input').press('Enter');
  const news = wim.page.locator('.news', { hasText: 'Ann: this one, please' });
  await news.waitFor({ timeout: 5000 });
  const line = await news.innerText();
  await sleep(300);
  const chimes = Number(await wim.page.locator('.wearer-view').getAttribute('data-chimes'));
  check(
    'the wearer reads it in one line, and hears that it came',
    chimes > 0,
    `${line}; ${chimes}`,
  );
  await page.keyboard.press('Escape');
  await ann.press('Escape'); // nothing is selected
  await page.locator('.look-here').last().click();
  const selected = page.locator('aside li.selected');
  await selected.waitFor({ timeout: 3000 });
  const look = await page.locator('.look-here').last().innerText();
  check('"look here" selects its mark', (await selected.count()) === 1, look);
  await shot(context, ann, 'chat');
  await shot(context, wim, 'wearer');
  await axe(context, ann, 'chat panel');
  await axe(context, wim, "wearer's view");
}

async function pause(context) {
  const { ann, wim, check, session } = context;
  const picture = ann.page.locator('canvas.picture');
  await wim.page.getByRole('button', { name: 'Pause picture' }).click();
  const note = ann.page.locator('.video .pane-note', {
    hasText: /paused the picture at \d\d:\d\d/,
  });
  await note.waitFor({ timeout: 5000 });
  await sleep(500);
  const left = await Promise.all(
    [ann, wim].map(({ page }) =>
      page.evaluate(() => {
        const canvas = document.querySelector('canvas.picture');
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const bright = data.some((value, i) => i % 4 < 3 && value > 0);
        return `${bright ? 'a picture' : 'nothing'}, frame '${canvas.dataset.frameId}', ${getComputedStyle(canvas).visibility}`;
      }),
    ),
  );
  check(
    'paused, no picture stays with the expert or the wearer',
    left.every((words) => words === "nothing, frame '', hidden"),
    left.join('; '),
  );
  const refused = await session.getFrame({}).then(
    () => 'a still',
    (error) => error.message,
  );
  check('no still is given', /has paused it/.test(refused), refused);
  const pose = async () => Number((await session.getStatus({})).pose.frameId);
  const [before] = [await pose(), await sleep(1500)];
  const status = await ann.page.locator('header .status').innerText();
  check(
    'tracking goes on',
    (await pose()) > before &&
      /picture paused the map stays live/.test(status.replace(/\s+/g, ' ')),
    status.replace(/\s+/g, ' '),
  );
  const words = await wim.page.locator('.paused-words').innerText();
  check('the wearer sees that it is paused', /Nobody sees the camera/.test(words), words);
  await shot(context, ann, 'paused-expert');
  await shot(context, wim, 'paused-wearer');
  await axe(context, ann, 'paused, expert');
  await axe(context, wim, 'paused, wearer');
  const begin = performance.now();
  await wim.press('p');
  await ann.page.waitForFunction(
    () => Number(document.querySelector('canvas.picture').dataset.frameId) > 0,
    undefined,
    { timeout: 5000 },
  );
  const ms = performance.now() - begin;
  check(
    'lifted by key, pictures come back',
    ms < 5000 && (await picture.isVisible()),
    `${ms.toFixed(0)} ms`,
  );
}
