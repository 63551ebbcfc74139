// Pictures of the window at seven sizes, light and dark, with marks and things: to be looked at. Makes files,
// checks only that the window came.
import { mkdirSync } from 'node:fs';

// As of the page (web/test/browser/layout.mjs), upright phones left out, and a small window.
const SIZES = [
  '800x600',
  '1024x768',
  '1280x720',
  '1366x768',
  '1920x1080',
  '2560x1440',
  '3440x1440',
];

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runShots(context) {
  const { options, ask, check, shot } = context;
  if (!options.shots) throw new Error('--shots: say which folder the pictures go to');
  mkdirSync(options.shots, { recursive: true });
  context.server = await context.start(['--mount', 'sim']);
  for (const [i, size] of SIZES.entries()) {
    await context.resize(size);
    context.desktop = await context.startDesktop(['--name', 'Tess']);
    const { desktop, screen } = context;
    const [width, height] = size.split('x');
    screen.input(
      ...['search', '--sync', '--onlyvisible', '--name', '.'],
      ...['windowmove', 0, 0, 'windowsize', width, height],
    );
    await desktop.until('tracking', ({ status }) => status.startsWith('tracking'), 90_000);
    if (i === 0) await fill(context);
    await desktop.until('marks', ({ marks }) => marks.length > 3, 20_000);
    await sleep(1500);
    shot('size-map');
    screen.press('s');
    await sleep(700);
    shot('size-video');
    screen.press('4');
    await sleep(500);
    shot('size-things');
    screen.press('F9'); // light
    screen.press('question');
    await sleep(700);
    shot('size-help-light');
    screen.press('question');
    screen.press('Escape');
    screen.press('s');
    await sleep(700);
    shot('size-light');
    screen.press('F9');
    await sleep(300);
    check(`the window of ${size}`, desktop.look().marks.length > 3, `${desktop.look().status}`);
    await desktop.stop();
    context.desktop = undefined;
  }
  ask('status');
}

/** Marks on features the map is sure of, a room, a message. */
async function fill({ ask, map }) {
  await sleep(4000);
  const sure = map().features.filter(({ depth_known }) => depth_known);
  const at = (share) => ['--feature', String(sure[Math.floor(share * (sure.length - 1))].id)];
  ask('annotate', '--shape', 'note', '--text', 'oil: check the level first', ...at(0.1));
  ask('annotate', '--shape', 'cube', ...at(0.3));
  ask('annotate', '--shape', 'arrow', ...at(0.5));
  ask('annotate', '--shape', 'pin', '--text', 'leaks', ...at(0.7));
  ask('annotate', '--shape', 'cube', ...at(0.9));
  ask(
    'scene',
    'add',
    '--shape',
    'room',
    '--size',
    '4,2.5,4',
    '--at',
    '0.16,1.22,-1.992',
    '--name',
    'room',
  );
  ask('say', 'The valve is the brass one, left of the pump.');
}
