// A phone as the wearable: Chromium with a fake camera that plays pictures of the simulator, whose truth is
// known, opens an invite link over https and becomes the camera; an expert in another Chromium sees it and
// places marks. Where this may make network namespaces, each has a network of its own, and the phone's is cut
// (SACCADE_CUT_S, 4 s by default). SACCADE_MARKS things are clicked (3 by default), from ten on a third of them in the map.
import { execFileSync, spawnSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { Expert } from './expert.mjs';
import { trust } from './invite.mjs';
import { startServer, Truth } from './server.mjs';
import { voice } from './wear_voice.mjs';
import { BITS, BLOCK, marks, MARKS } from './wear_marks.mjs';

const FRAMES = 300; // played to and fro: 20 s without a jump
const PHONE = { width: 390, height: 844 };
const OUT_MS = 1000;
const CUT_S = Number(process.env['SACCADE_CUT_S'] ?? 4);

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const ip = (...words) => spawnSync('ip', words).status === 0;

/** Server, phone and expert, each in a network namespace; undefined: this user may not make them. */
function makeNetworks() {
  const [s, p, e] = ['s', 'p', 'e'].map((name) => `saccade-${process.pid}-${name}`);
  const link = (other, network, n) =>
    ip('link', 'add', `v${n}s`, 'netns', s, 'type', 'veth', 'peer', 'name', 'v', 'netns', other) &&
    ip('-n', s, 'addr', 'add', `${network}.1/24`, 'dev', `v${n}s`) &&
    ip('-n', other, 'addr', 'add', `${network}.2/24`, 'dev', 'v') &&
    ip('-n', s, 'link', 'set', `v${n}s`, 'up') &&
    ip('-n', other, 'link', 'set', 'v', 'up') &&
    ip('-n', other, 'route', 'add', 'default', 'via', `${network}.1`);
  const made =
    [s, p, e].every(
      (name) => ip('netns', 'add', name) && ip('-n', name, 'link', 'set', 'lo', 'up'),
    ) &&
    link(p, '10.77.1', 1) &&
    link(e, '10.77.2', 2);
  const close = () => [s, p, e].forEach((name) => ip('netns', 'del', name));
  if (!made) {
    close();
    return undefined;
  }
  const inside = (name) => ['ip', 'netns', 'exec', name];
  return {
    server: inside(s),
    phone: inside(p),
    expert: inside(e),
    host: '10.77.1.1',
    cut: () => ip('-n', p, 'link', 'set', 'v', 'down'),
    mend: () =>
      ip('-n', p, 'link', 'set', 'v', 'up') &&
      ip('-n', p, 'route', 'add', 'default', 'via', '10.77.1.1'),
    close,
  };
}

/** What the fake camera plays: each picture shows its number in its uppermost rows. */
function makeVideo(binary, folder, source) {
  const recording = join(folder, 'recording');
  const cli = join(dirname(binary), 'saccade');
  execFileSync(cli, ['record', '--source', source, '--frames', `0:${FRAMES}`, '--out', recording]);
  const { width, height } = BLOCK;
  const box = (i, colour, enable) =>
    `drawbox=x=${i * width}:y=0:w=${width}:h=${height}:color=${colour}:t=fill${enable}`;
  const boxes = Array.from({ length: BITS }, (_, i) => [
    box(i, '0x202020', ''),
    box(i, '0xe0e0e0', `:enable='gt(bitand(n,${1 << i}),0)'`),
  ]).flat();
  const video = join(folder, 'camera.mjpeg');
  const filter = `${boxes.join(',')},split[a][b];[b]reverse[r];[a][r]concat`;
  const coding = ['-c:v', 'mjpeg', '-q:v', '2', '-pix_fmt', 'yuvj420p', '-f', 'mjpeg', video];
  // Named by their times, all below 10 s: in order.
  const input = ['-pattern_type', 'glob', '-i', join(recording, 'rgb', '*.png')];
  execFileSync('ffmpeg', ['-v', 'error', '-y', ...input, '-filter_complex', filter, ...coding]);
  return { video, camera: join(recording, 'camera.yaml') };
}

/** As optics.mjs takes it. */
function lensOf(yaml) {
  const value = (key) => JSON.parse(new RegExp(`^${key}: (.*)$`, 'm').exec(yaml)[1]);
  return {
    ...{ fxPx: value('fx'), fyPx: value('fy'), cxPx: value('cx'), cyPx: value('cy') },
    distortion: value('distortion'),
  };
}

/** Where each object is in each picture that is played. */
async function truthOf(binary, folder, source) {
  const file = join(folder, 'truth.jsonl');
  const listen = ['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'];
  const data = ['--data-dir', join(folder, 'truth-data'), '--sim-truth', file];
  const server = await startServer(binary, [
    '--source',
    source,
    '--speed',
    'max',
    ...data,
    ...listen,
  ]);
  const truth = new Truth(file);
  for (const end = Date.now() + 60_000; !truth.frame(FRAMES - 1) && Date.now() < end; )
    await sleep(50);
  await server.stop();
  return truth;
}

export async function runWear({ server: binary, chromium, seed, shots, folder }) {
  const networks = makeNetworks();
  const context = { failures: 0, shots, chromium, folder, networks };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  const data = join(folder, 'data');
  const inServer = networks?.server ?? [];
  context.saccade = (...words) => {
    const cli = join(dirname(binary), 'saccade');
    const [command, ...rest] = [...inServer, cli, '--data-dir', data, ...words];
    const env = { ...process.env, HOME: folder, XDG_CONFIG_HOME: join(folder, 'config') };
    return execFileSync(command, rest, { encoding: 'utf8', env });
  };
  try {
    const source = `sim:desk?seed=${seed}&motion=desk&auto_exposure=off&fps=60`;
    const { video, camera } = makeVideo(binary, folder, source);
    context.truth = await truthOf(binary, folder, source);
    context.video = video;
    context.camera = lensOf(readFileSync(camera, 'utf8'));
    const config = join(folder, 'server.toml');
    writeFileSync(config, '[tls]\nrequired = true\n[auth]\nrequired = true\n');
    const host = networks?.host ?? '127.0.0.1';
    const listen = networks ? ['0.0.0.0:0', '0.0.0.0:0'] : [`${host}:0`, `${host}:0`];
    context.server = await startServer(
      binary,
      [
        ...[
          '--source',
          'phone:?fps=15',
          '--camera',
          camera,
          '--data-dir',
          data,
          '--config',
          config,
        ],
        ...['--grpc', listen[0], '--http', listen[1]],
      ],
      inServer,
    );
    console.log(
      `      ${networks ? 'three networks' : 'one network: this user may not make others'}`,
    );
    await checkAll(context);
  } finally {
    await context.phone?.close();
    await context.expert?.close();
    if (process.env['SACCADE_VERBOSE']) console.log(context.server?.errors());
    await context.server?.stop();
    networks?.close();
  }
  return context.failures;
}

async function checkAll(context) {
  const { check, server, saccade, folder } = context;
  const said = () => /waiting for the phone/.test(server.errors());
  for (const end = Date.now() + 5000; !said() && Date.now() < end; ) await sleep(50);
  check('the server starts without a phone, and says so', said(), 'within 5 s');
  const home = join(folder, 'home');
  trust(context, home);
  const wearer = JSON.parse(saccade('invite', '--role', 'wearer', '--json'));
  const pilot = JSON.parse(saccade('invite', '--role', 'pilot', '--json'));
  check(
    "the wearer's link opens /wear",
    /\/wear#invite=/.test(wearer.link),
    wearer.link.split('#')[0],
  );
  await openPhone(context, wearer.link, home);
  await openExpert(context, pilot.link, home);
  await marks(context);
  await shot(context, context.expert, 'marks-expert');
  await shot(context, context.phone, 'marks-phone');
  await latency(context);
  await voice(context);
  if (context.networks) await cut(context);
  await revocation(context, wearer.id, pilot.id);
  const errors = [...context.phone.errors, ...context.expert.errors];
  check('page errors', errors.length === 0, errors.join('; ') || 'none');
}

async function shot({ shots }, { page }, name) {
  if (shots) await page.screenshot({ path: join(shots, `wear-${name}.png`) });
}

async function openPhone(context, link, home) {
  const { chromium, networks, video, check } = context;
  context.phone = await Expert.open(chromium, link, {
    home,
    prefix: networks?.phone ?? [],
    viewport: PHONE,
    flags: [
      '--use-fake-device-for-media-stream',
      '--use-fake-ui-for-media-stream',
      `--use-file-for-fake-video-capture=${video}`,
    ],
  });
  const { page } = context.phone;
  await page.locator('.intro').waitFor();
  await shot(context, context.phone, 'start');
  check('the invite is gone from the address', !page.url().includes('invite'), page.url());
  const begin = Date.now();
  await page.locator('.start').click();
  await page.locator('.wear-view[data-uplink="live"]').waitFor({ timeout: 20_000 });
  check('the phone is the camera', true, `${Date.now() - begin} ms after the tap`);
  const tracked = page.locator('.line', { hasText: /tracking/ }).waitFor({ timeout: 30_000 });
  await tracked.catch(async (error) => {
    const view = page.locator('.wear-view');
    console.log(await view.innerText(), await view.getAttribute('data-latency'));
    throw error;
  });
  check('and is tracked', true, `${Date.now() - begin} ms after the tap`);
}

async function openExpert(context, link, home) {
  const { chromium, networks, check, saccade } = context;
  context.expert = await Expert.open(chromium, link, { home, prefix: networks?.expert ?? [] });
  await context.expert.waitForStatus(/^tracking/, 30_000);
  await context.expert.page.locator('.app[data-first-picture-ms]').waitFor();
  const viewer = JSON.parse(saccade('invite', '--role', 'viewer', '--json')).link;
  const grpc = context.server.grpc.replace('0.0.0.0', networks?.host);
  const whom = ['--trust', join(context.folder, 'root.pem'), '--invite', viewer, '--server', grpc];
  context.whom = whom.filter((word) => word !== '--invite' && word !== viewer); // its pass is kept
  const status = saccade(...whom, 'status').replace(/\s+/g, ' ');
  check('`saccade status` says tracking', /tracking/.test(status), status.slice(0, 90));
  await shot(context, context.expert, 'expert');
}

async function latency({ check, phone, expert }) {
  const view = phone.page.locator('.wear-view');
  const figures = await view.getAttribute('data-latency');
  const shown = await phone.page.locator('.latency').innerText();
  const total = Number(/total (\d+)/.exec(figures)?.[1] ?? Infinity);
  // One second: here two cores share two browsers with software GPUs, the encoders and the tracker.
  check('camera to marks on the phone, p50/p95 [ms]', total < 1000, figures);
  check('and the page says so', /\d+ ms camera to marks/.test(shown), shown);
  const strip = await expert.page
    .locator('.strip, footer')
    .first()
    .innerText()
    .catch(() => '');
  console.log(`      expert: ${strip.replace(/\s+/g, ' ')}`);
}

async function cut(context) {
  const { check, networks, phone, expert } = context;
  const view = phone.page.locator('.wear-view');
  networks.cut();
  await sleep(CUT_S * 1000);
  await shot(context, phone, 'cut-phone');
  await shot(context, expert, 'cut-expert');
  const drawn = await phone.page.evaluate(() => {
    const canvas = document.querySelector('canvas.marks');
    return `${canvas.style.visibility}, of frame '${canvas.dataset.frameId}'`;
  });
  check('a picture whose pose is not known has no marks', drawn === "hidden, of frame ''", drawn);
  const during = await phone.page.locator('.line').innerText();
  const expertDuring = (await expert.page.locator('header .status').innerText()).replace(
    /\n/g,
    ' ',
  );
  // Watched from within, so that no slow tool counts.
  const before = Number(await phone.page.locator('canvas.picture').getAttribute('data-frame-id'));
  const back = phone.page.evaluate(async (old) => {
    for (;;) {
      const live = document.querySelector('.wear-view').dataset.uplink === 'live';
      const id = Number(document.querySelector('canvas.picture').dataset.frameId);
      if (live && id > old) return Date.now();
      await new Promise((resolve) => setTimeout(resolve, 5));
    }
  }, before);
  const mended = Date.now();
  networks.mend();
  const ms = (await back) - mended;
  check(
    `cut for ${CUT_S} s, pictures tracked again within 2 s`,
    ms < 2000,
    `${ms} ms; it said: ${during}`,
  );
  check('the expert is told', /no picture|lost|old|coasting/.test(expertDuring), expertDuring);
  await view.locator('.line', { hasText: /tracking/ }).waitFor({ timeout: 20_000 });
  const count = (await expert.annotationIds()).length;
  check('in the same map, with its marks', count === MARKS, `${count} marks, tracking`);
}

async function revocation({ check, phone, expert, saccade, ...context }, wearerId, pilotId) {
  const out = (page, selector) =>
    page.evaluate(
      (where) =>
        new Promise((resolve) => {
          const look = () => {
            const text = document.querySelector(where)?.textContent ?? '';
            if (/refused/.test(text)) resolve({ atMs: Date.now(), text });
            else setTimeout(look, 5);
          };
          look();
        }),
      selector,
    );
  const outs = [out(phone.page, '.line'), out(expert.page, 'header .status')];
  for (const [i, id] of [wearerId, pilotId].entries()) {
    saccade('revoke', id);
    const begin = Date.now(); // revoked since just before: the command answers when it is done
    const { atMs, text } = await outs[i];
    const who = i === 0 ? 'phone' : 'expert';
    check(
      `revoked: the ${who} is out within a second`,
      atMs - begin < OUT_MS,
      `${atMs - begin} ms: ${text}`,
    );
  }
  await shot(context, phone, 'revoked');
}
