// The page in real Chromium against the real server on the simulator; prints what it measured.
// usage: run.mjs [--server PATH] [--evaluator PATH] [--chromium PATH] [--seed N] [--shots DIR]
//        [--only CHECK,CHECK]  (of tools; of clicks the view)  [--count N]  (of clicks)
//        [--size WxH]  (of both windows of tools)  [--part PART]
// page: what is in no other part. gaze: the turning of the head. dots: measured features while the wearer turns.
// person: typing, keys, tabs, a reload. invite: TLS, invites and what ends them, from another address than
// loopback where this may make a network namespace. layout: sizes of window and barriers. tools: two people and
// what they draw, point at and change. keys: everything without a mouse. shapes: marks by their pixels, page
// against server. wear: a phone as the camera, and an expert, each in a network of its own. waiting: who comes
// waits to be let in. talk: voices, messages, the pause of the picture, the first task. oidc: a firm's people sign
// in. calibrate: a lens from pictures of a board. surfaces: the place, against the simulator's depth. By hand alone: surfaces-load (a large room), clicks (over a late network), shots (pictures at seven sizes, light and dark).
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

const web = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
const { values: options } = parseArgs({
  options: {
    server: { type: 'string', default: join(web, '../build/release/bin/saccade-server') },
    evaluator: { type: 'string', default: join(web, '../build/release/bin/saccade-eval') },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
    seed: { type: 'string', default: '1' },
    shots: { type: 'string' },
    part: { type: 'string', default: 'page' },
    only: { type: 'string' },
    count: { type: 'string' },
    size: { type: 'string', default: '1000x640' },
  },
});

// 77 is CTest's "skipped".
const needed = {
  [options.server]: 'build saccade-server',
  [options.evaluator]: 'build saccade-eval',
  [options.chromium]: 'install chromium',
  [join(web, 'dist/index.html')]: 'run npm run build in web/',
  [join(web, 'node_modules/playwright-core')]: 'run npm ci in web/',
};
for (const [path, remedy] of Object.entries(needed)) {
  if (existsSync(path)) continue;
  console.log(`skipped: no ${path}; ${remedy}`);
  process.exit(77);
}
const PARTS = {
  page: async () => (await import('./checks.mjs')).runChecks,
  gaze: async () => (await import('./gaze.mjs')).runGaze,
  dots: async () => (await import('./dots.mjs')).runDots,
  person: async () => (await import('./person.mjs')).runPerson,
  tools: async () => (await import('./tools.mjs')).runTools,
  invite: async () => (await import('./invite.mjs')).runInvite,
  layout: async () => (await import('./layout.mjs')).runLayout,
  wear: async () => (await import('./wear.mjs')).runWear,
  waiting: async () => (await import('./waiting.mjs')).runWaiting,
  talk: async () => (await import('./talk.mjs')).runTalk,
  clicks: async () => (await import('./clicks.mjs')).runClicks,
  shapes: async () => (await import('./drawn_shapes.mjs')).runShapes,
  keys: async () => (await import('./keyboard.mjs')).runKeyboard,
  shots: async () => (await import('./shots.mjs')).runShots,
  things: async () => (await import('./things.mjs')).runThings,
  calibrate: async () => (await import('./calibrate.mjs')).runCalibrate,
  surfaces: async () => (await import('./surfaces.mjs')).runSurfaces,
  'surfaces-load': async () => (await import('./surfaces_load.mjs')).runSurfacesLoad,
  oidc: async () => (await import('./oidc.mjs')).runOidc,
};
if (!(options.part in PARTS)) throw new Error(`--part: one of ${Object.keys(PARTS).join(', ')}`);
const runChecks = await PARTS[options.part]();

const folder = mkdtempSync(join(tmpdir(), 'saccade-browser-test-'));
/** A port that is free now: the restarted server has to come back to the same one. */
const port = await new Promise((resolve) => {
  const probe = createServer().listen(0, '127.0.0.1', () => {
    const found = probe.address().port;
    probe.close(() => resolve(found));
  });
});
let failures = 1;
try {
  failures = await runChecks({ ...options, folder, port });
} catch (error) {
  console.error(error);
} finally {
  rmSync(folder, { recursive: true, force: true });
}
process.exit(failures === 0 ? 0 : 1);
