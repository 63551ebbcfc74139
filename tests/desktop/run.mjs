// saccade-client in a real window against the real server on the simulator; prints what it measured.
// usage: run.mjs [--client PATH] [--server PATH] [--cli PATH] [--evaluator PATH] [--seed N] [--size WxH]
//        [--shots DIR] [--part desktop|gaze|things]   (gaze: the turning of the head, two wearers in tabs, notes, ink)
// By hand alone: --part shots (pictures at seven sizes, light and dark).
import { spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, rmSync, statSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

const root = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
const { values: options } = parseArgs({
  options: {
    client: { type: 'string', default: join(root, 'build/release/bin/saccade-client') },
    server: { type: 'string', default: join(root, 'build/release/bin/saccade-server') },
    cli: { type: 'string', default: join(root, 'build/release/bin/saccade') },
    evaluator: { type: 'string', default: join(root, 'build/release/bin/saccade-eval') },
    seed: { type: 'string', default: '1' },
    size: { type: 'string', default: '1280x720' },
    shots: { type: 'string' },
    part: { type: 'string', default: 'desktop' },
  },
});

// 77 is CTest's "skipped".
const needed = {
  [options.client]: 'build saccade-client',
  [options.server]: 'build saccade-server',
  [options.cli]: 'build saccade',
  [options.evaluator]: 'build saccade-eval',
  [join(root, 'web/node_modules/pngjs')]: 'run npm ci in web/',
};
for (const [path, remedy] of Object.entries(needed)) {
  if (existsSync(path)) continue;
  console.log(`skipped: no ${path}; ${remedy}`);
  process.exit(77);
}
for (const [program, pack] of [
  ['Xvfb', 'xvfb'],
  ['xdotool', 'xdotool'],
]) {
  if (spawnSync('which', [program]).status === 0) continue;
  console.log(`skipped: no ${program}; install ${pack}`);
  process.exit(77);
}
const { startServer, renderDepths, renderTruth, Truth } = await import(
  '../../web/test/browser/server.mjs'
);
const { Screen } = await import('./screen.mjs');
const { Desktop } = await import('./desktop.mjs');
const parts = {
  desktop: async () => (await import('./checks.mjs')).runDesktop,
  gaze: async () => (await import('./work.mjs')).runWork,
  things: async () => (await import('./things.mjs')).runThings,
  shots: async () => (await import('./shots.mjs')).runShots,
};
if (!(options.part in parts)) throw new Error(`--part: one of ${Object.keys(parts).join(', ')}`);
const runPart = await parts[options.part]();

const folder = mkdtempSync(join(tmpdir(), 'saccade-desktop-test-'));
/** A port that is free now: the restarted server has to come back to the same one. */
const port = await new Promise((resolve) => {
  const probe = createServer().listen(0, '127.0.0.1', () => {
    const found = probe.address().port;
    probe.close(() => resolve(found));
  });
});
const [width, height] = options.size.split('x').map(Number);
const source = `sim:desk?motion=sway&seed=${options.seed}`;
const truthFile = join(folder, 'truth.jsonl');
const grpc = `127.0.0.1:${port}`;
const start = (more = []) =>
  startServer(options.server, [
    ...['--source', source, '--sim-truth', truthFile, '--grpc', grpc, '--http', '127.0.0.1:0'],
    ...['--data-dir', join(folder, 'data'), ...more],
  ]);
const ask = (...words) => {
  const { stdout, stderr, status } = spawnSync(
    options.cli,
    ['--server', grpc, '--plain', '--json', ...words],
    {
      env: { ...process.env, HOME: folder, XDG_STATE_HOME: join(folder, 'cli') },
      maxBuffer: 1 << 26,
    },
  );
  if (status !== 0) throw new Error(`saccade ${words.join(' ')}: ${stderr}`);
  return JSON.parse(stdout);
};

const context = { failures: 0, options, folder, grpc, start, source };
context.resize = async (size) => {
  context.screen.stop();
  options.size = size;
  const own = join(folder, size); // the old one takes its file away when it ends
  mkdirSync(own);
  context.screen = await Screen.start(own, ...size.split('x').map(Number));
};
context.check = (name, ok, figures) => {
  console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
  if (!ok) ++context.failures;
};
context.ask = ask;
context.annotations = () => ask('annotations', 'list');
context.map = () => ask('map');
context.status = () => ask('status');
context.render = (id) => renderTruth(options.evaluator, source, id, join(folder, 'render'));
context.depths = (id) => renderDepths(options.evaluator, source, id, join(folder, 'depths'));
context.shot = (name) => {
  if (options.shots) context.screen.shot(join(options.shots, `${name}-${options.size}.png`));
};
context.openTruth = () => new Truth(truthFile);
context.isPrivate = (file) => existsSync(file) && (statSync(file).mode & 0o777) === 0o600;
context.startDesktop = async (args = []) => {
  const home = join(folder, 'home');
  mkdirSync(home, { recursive: true });
  return Desktop.start(
    options.client,
    ['--server', grpc, '--plain', ...args],
    context.screen,
    home,
  );
};
let failures = 1;
try {
  context.screen = await Screen.start(folder, width, height);
  await runPart(context);
  failures = context.failures;
} catch (error) {
  console.error(error);
  context.shot('failed');
} finally {
  await context.desktop?.stop('SIGKILL').catch(() => undefined);
  await context.server?.stop();
  context.screen?.stop();
  rmSync(folder, { recursive: true, force: true });
}
process.exit(failures === 0 ? 0 : 1);
