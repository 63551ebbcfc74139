// What a person does in the window beside clicking cubes: writes a note, draws ink, undoes, turns the head,
// changes between two wearers.
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { startServer } from '../../web/test/browser/server.mjs';
import { inCamera, project } from '../../web/test/browser/optics.mjs';
import { covered } from './clicks.mjs';
import { runMarks } from './marks.mjs';
import { Desktop } from './desktop.mjs';
import { Screen } from './screen.mjs';

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runWork(context) {
  context.server = await context.start(['--mount', 'sim']);
  context.truth = context.openTruth();
  const other = await startServer(context.options.server, [
    ...[
      '--source',
      'sim:desk?motion=still&seed=7',
      '--grpc',
      '127.0.0.1:0',
      '--http',
      '127.0.0.1:0',
    ],
    ...['--data-dir', join(context.folder, 'other')],
  ]);
  try {
    context.desktop = await context.startDesktop(['--server', other.grpc, '--name', 'Tess']);
    await context.desktop.until('tracking', ({ status }) => status.startsWith('tracking'), 90_000);
    await note(context);
    await ink(context);
    await undo(context);
    await shapes(context);
    await drawn(context);
    await runMarks(context, { findObject, marked, idsOf, place });
    await laser(context);
    await head(context);
    await tabs(context);
    const { ms, code } = await context.desktop.stop('SIGTERM');
    context.desktop = undefined;
    context.check(
      'ends on SIGTERM within 2 s',
      ms < 2000 && code === 0,
      `${ms.toFixed(0)} ms, code ${code}`,
    );
  } finally {
    await other.stop();
  }
}

/** Where an object of the simulator's is on the screen now. */
function objectIn({ desktop, truth }, which = 0) {
  const { video } = desktop.look();
  const inside = ([u, v]) => u > 60 && v > 60 && u < video.width - 60 && v < video.height - 60;
  const at = ([u, v]) => [
    video.left + (u + 0.5) * video.scale,
    video.top + (v + 0.5) * video.scale,
  ];
  const objects = (truth.frame(video.frame)?.objects ?? []).filter(
    ({ visible, pixel }) =>
      visible && pixel && inside(pixel) && !covered(desktop.look(), at(pixel)),
  );
  const object = objects[which % Math.max(objects.length, 1)];
  if (!object) return undefined;
  return at(object.pixel);
}

async function findObject(context, which) {
  for (let i = 0; i < 100; ++i) {
    const at = objectIn(context, which);
    if (at) return at;
    await sleep(100);
  }
  throw new Error('no object of the simulator came into view');
}

const marked = (before) => (shown) => shown.marks.some(({ id }) => !before.has(id));
const idsOf = ({ marks }) => new Set(marks.map(({ id }) => id));

async function note(context) {
  const { desktop, screen, check } = context;
  await desktop.enlarge('video');
  screen.press('n');
  await desktop.until('the note is in hand', ({ tool }) => tool === 'Note');
  screen.click(await findObject(context, 0));
  await desktop.until('the field', ({ editing }) => editing);
  await sleep(300);
  screen.input('type', '--delay', '40', 'check the seal');
  await sleep(200);
  context.shot('note');
  const before = idsOf(desktop.look());
  screen.press('Return');
  const shown = await desktop.until('the note', marked(before));
  const mark = shown.marks.find(({ id }) => !before.has(id));
  const kept = context.annotations().find(({ id }) => id === mark.id);
  check(
    'a note is what was typed, by whom it was, and letters are no tools meanwhile',
    kept?.text === 'check the seal' && kept.author === 'Tess' && shown.tool === 'Note',
    `"${kept?.text}" by ${kept?.author}`,
  );
}

async function ink(context) {
  const { desktop, screen, check } = context;
  screen.press('i');
  await desktop.until('ink is in hand', ({ tool }) => tool === 'Ink');
  const before = idsOf(desktop.look());
  const [x, y] = await findObject(context, 1);
  screen.move([x - 40, y]);
  screen.input('mousedown', 1);
  for (let i = -40; i <= 40; i += 8) screen.move([x + i, y + 12 * Math.sin(i / 8)]);
  screen.input('mouseup', 1);
  const shown = await desktop.until(
    'the stroke',
    (now) => marked(before)(now) || now.refused.video !== '',
  );
  const mark = shown.marks.find(({ id }) => !before.has(id));
  const kept = context.annotations().find(({ id }) => id === mark?.id);
  check(
    'a stroke drawn with the mouse is ink',
    kept?.shape === 'ink',
    kept?.shape ?? shown.refused.video,
  );
  await desktop.until('live again', ({ video }) => !video.frozen);
}

async function undo(context) {
  const { desktop, screen, check } = context;
  const before = desktop.look().marks.length;
  screen.press('z');
  await desktop.until('one mark less', ({ marks }) => marks.length === before - 1);
  screen.press('y');
  await desktop.until('and back', ({ marks }) => marks.length === before);
  screen.press('v', 'Escape');
  check('undo and redo by their keys', true, `${before} marks, ${before - 1}, ${before}`);
}

/**
 * Places a mark with a tool, again where it was refused (the frame clicked may have left the server's memory
 * on a slow machine); the mark, as the server has it.
 */
async function place(context, key, tool, act) {
  const { desktop, screen } = context;
  for (let tries = 0; tries < 5; ++tries) {
    screen.press(key);
    await desktop.until(`${tool} is in hand`, (shown) => shown.tool === tool);
    const before = idsOf(desktop.look());
    await act();
    const refused = ({ refused: { video, map } }) => video || map;
    const shown = await desktop.until(tool, (now) => marked(before)(now) || refused(now), 30_000);
    const mark = shown.marks.find(({ id }) => !before.has(id));
    if (mark) return context.annotations().find(({ id }) => id === mark.id);
    console.log(`      ${tool} refused: ${refused(shown)}`);
    screen.press('Escape');
    await desktop.until('the refusal has been read', (now) => !refused(now), 20_000);
  }
  return undefined;
}

/** A pin, a box, and a distance between two clicks. */
async function shapes(context) {
  const { desktop, screen, check } = context;
  const placed = [];
  for (const [key, tool, clicks] of [
    ['1', 'Pin', 1],
    ['b', 'Box', 1],
    ['d', 'Distance', 2],
  ]) {
    placed.push(
      await place(context, key, tool, async () => {
        for (let i = 0; i < clicks; ++i) {
          screen.click(await findObject(context, i + 2));
          await sleep(300);
        }
      }),
    );
  }
  context.shot('shapes');
  const [pin, box, measure] = placed;
  check(
    'a pin has a number, a box is 10 cm, a distance a length with its sigma',
    pin?.shape === 'pin' &&
      box?.shape === 'box' &&
      measure?.shape === 'measure' &&
      measure.length_m > 0.01,
    `${pin?.shape} ${pin?.number}, ${box?.shape}, ${JSON.stringify(measure?.length_m)} ± ${measure?.length_sigma_m} m`,
  );
}

/** A box from corner to corner, ink in the map, a mark that is hidden. */
async function drawn(context) {
  const { desktop, screen, check } = context;
  const drag = async ([x, y], to) => {
    screen.move([x, y]);
    screen.input('mousedown', 1);
    for (const share of [0.25, 0.5, 0.75, 1]) {
      screen.move([x + share * to[0], y + share * to[1]]);
      await sleep(60);
    }
    screen.input('mouseup', 1);
  };
  const box = await place(context, 'b', 'Box', async () =>
    drag(await findObject(context, 1), [90, 60]),
  );
  const edges = box?.extent_m ?? [0, 0, 0];
  check(
    'a box is drawn from corner to corner',
    box?.shape === 'box' && Math.max(...edges) > 1.1 * Math.min(...edges), // a click's are all alike
    `${edges.map((edge) => `${(1000 * edge).toFixed(0)} mm`).join(' x ')}`,
  );
  screen.press('Escape', 'Escape', 'Escape');
  await desktop.enlarge('map');
  screen.press('h');
  await sleep(1000);
  const stroke = await place(context, 'i', 'Ink', async () => {
    const at = mappedPlace(context);
    if (at) await drag(at, [80, 30]);
  });
  context.shot('map-ink');
  const points = desktop.look().marks.find(({ id }) => id === stroke?.id)?.points;
  check('ink is drawn in the map too', stroke?.shape === 'ink' && points > 3, `${points} points`);
  screen.press('v', 'Escape');
  await desktop.enlarge('video');
  screen.press('Escape', 'Escape');
  await hiding(context, box?.id);
}

/** Where a feature stands in the large map, in the window; nothing: none is there. */
function mappedPlace({ desktop, map }) {
  const {
    pane: [x, y, width, height],
    eye: [tx, ty, tz, ...rotation],
    focal,
  } = desktop.look().map;
  const lens = { fxPx: focal, fyPx: focal, cxPx: width / 2, cyPx: height / 2, distortion: [] };
  const pose = { translation_m: [tx, ty, tz], rotation_xyzw: rotation };
  for (const { depth_known: known, point_in_world_m: point } of map().features) {
    const pixel = known && project(lens, inCamera(pose, point));
    if (!pixel || pixel[0] < 60 || pixel[1] < 60) continue;
    if (pixel[0] > width - 200 || pixel[1] > height - 100) continue;
    const at = [x + pixel[0], y + pixel[1]];
    if (!covered(desktop.look(), at)) return at;
  }
  return undefined;
}

/** Selected marks are hidden, and come back all together. */
async function hiding({ desktop, screen, check }, id) {
  screen.press('ctrl+a');
  const all = await desktop.until('all', (s) => s.selection.length === s.marks.length);
  screen.press('m');
  const none = await desktop.until('they are hidden', ({ hidden }) => hidden === all.marks.length);
  screen.press('m');
  const back = await desktop.until('they are back', ({ hidden }) => hidden === 0);
  check(
    'selected marks are hidden by M, and by M they come back',
    back.marks.some((mark) => mark.id === id),
    `${none.hidden} hidden, then ${back.hidden}`,
  );
}

/** The pointer of one is seen by the other while it is pressed, and then gone. */
async function laser(context) {
  const { desktop, screen, check } = context;
  const folder = mkdtempSync(join(tmpdir(), 'saccade-desktop-test-'));
  const other = await Screen.start(folder, 1280, 720);
  const words = ['--server', context.grpc, '--plain', '--name', 'Uwe'];
  const second = await Desktop.start(context.options.client, words, other, folder);
  try {
    await second.until('tracking', ({ status }) => status.startsWith('tracking'), 30_000);
    screen.press('w');
    await desktop.until('the laser is in hand', ({ tool }) => tool === 'Laser pointer');
    const [x, y] = await findObject(context, 0);
    screen.move([x, y]);
    const begin = performance.now();
    screen.input('mousedown', 1);
    const down = performance.now(); // xdotool takes some of it
    await second
      .until('the laser', ({ lasers }) => lasers === 1)
      .catch((error) => {
        const { refused, tool } = desktop.look();
        throw new Error(`${tool}, refused ${JSON.stringify(refused)}: ${error.message}`);
      });
    const at = performance.now();
    for (let i = 0; i < 5; ++i) screen.move([x + 4 * i, y]);
    other.shot(join(folder, 'laser.png'));
    screen.input('mouseup', 1);
    const up = performance.now();
    await second.until('it is gone', ({ lasers }) => lasers === 0);
    const kept = context.annotations().length;
    check(
      'a laser pointer is seen by the other expert, and gone when let go',
      at - begin < 1000,
      `seen ${(at - down).toFixed(0)} to ${(at - begin).toFixed(0)} ms after the press, gone after ${(performance.now() - up).toFixed(0)} ms, ${kept} marks as before`,
    );
  } finally {
    await second.stop('SIGKILL');
    other.stop();
    rmSync(folder, { recursive: true, force: true });
  }
  screen.press('v');
}

async function head(context) {
  const { desktop, screen, check } = context;
  screen.press('g');
  await desktop.until('looking is in hand', ({ tool }) => tool === 'Look');
  screen.click(await findObject(context, 2));
  const begin = performance.now();
  const turning = await desktop.until(
    'the head turns',
    ({ gaze, refused }) => gaze === 'saccade' || gaze === 'fixate' || refused.video !== '',
  );
  check(
    'a click turns the head, by a lease',
    turning.lease === 2,
    `${turning.gaze}; ${turning.refused.video || 'lease held'}`,
  );
  await desktop.until('it holds', ({ arrived }) => arrived, 60_000);
  context.shot('gaze');
  check(
    'and it holds what was clicked',
    true,
    `after ${(performance.now() - begin).toFixed(0)} ms`,
  );
  screen.press('0');
  await desktop.until('home', ({ gaze }) => gaze === 'home');
  screen.press('q');
  const released = await desktop.until('the lease is given back', ({ lease }) => lease === 0);
  check('home and release by their keys', released.lease === 0, released.gaze);
  screen.press('v');
}

async function tabs(context) {
  const { desktop, screen, check } = context;
  const first = desktop.look();
  screen.press('ctrl+Tab');
  const second = await desktop.until(
    'the other wearer',
    ({ tab, video }) => tab === 1 && video !== null,
    20_000,
  );
  await desktop.until('tracking there', ({ status }) => status.startsWith('tracking'), 60_000);
  context.shot('tabs');
  check(
    'another server is another tab, with its own marks',
    second.marks.length === 0 && first.marks.length > 0,
    `${first.marks.length} marks here, ${second.marks.length} there`,
  );
}
