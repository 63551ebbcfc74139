// What a real server records, read by MCAP's own reader: whole, rotated, after kill -9, on a full disk.
// usage: run.mjs --server PATH --cli PATH
import { execFile } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AnnotationService, AnnotationShape } from '../../src/gen/saccade/v1/annotation_pb.js';
import { RecordingService } from '../../src/gen/saccade/v1/recording_pb.js';
import { ReplayService } from '../../src/gen/saccade/v1/replay_pb.js';
import { SessionService, Topic } from '../../src/gen/saccade/v1/session_pb.js';
import { TalkService } from '../../src/gen/saccade/v1/talk_pb.js';
import { startServer } from '../browser/server.mjs';

const { values: options } = parseArgs({
  options: { server: { type: 'string' }, cli: { type: 'string' } },
});
for (const needed of ['@mcap/core', '@connectrpc/connect-web']) {
  if (existsSync(new URL(`../../node_modules/${needed}`, import.meta.url))) continue;
  console.log(`skipped: no ${needed}; run npm ci in web/`);
  process.exit(77);
}
const { readCut, readWhole } = await import('./read.mjs');

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
let failures = 0;
function check(name, ok, figures) {
  console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
  if (!ok) ++failures;
}

const folder = mkdtempSync(join(tmpdir(), 'saccade-recording-'));
let servers = 0;
/** A server on the simulator, with a file of configuration, and the command line's way to it. */
async function start(config, args = [], source = 'sim:desk?width=320&height=240') {
  const file = join(folder, `${++servers}.toml`);
  writeFileSync(file, config);
  const server = await startServer(options.server, [
    ...['--source', source, '--config', file],
    ...['--data-dir', join(folder, `data${servers}`), ...args],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  server.cli = (...words) =>
    new Promise((resolve) => {
      const line = ['--server', server.grpc, ...words, '--json'];
      execFile(options.cli, line, (error, out, err) =>
        resolve({ code: error?.code ?? 0, out, err }),
      );
    });
  const transport = createGrpcWebTransport({ baseUrl: server.http });
  server.client = (service) => createClient(service, transport);
  return server;
}

const rises = (numbers) => numbers.every((each, i) => i === 0 || each > numbers[i - 1]);
/** Types of the NAL units of one access unit, Annex B. */
function nalTypes(data) {
  const types = [];
  for (let i = 0; i + 3 < data.length; ++i) {
    if (data[i] === 0 && data[i + 1] === 0 && data[i + 2] === 1) types.push(data[i + 3] & 31);
  }
  return types;
}
const filesOf = (directory) =>
  readdirSync(directory)
    .sort()
    .map((name) => join(directory, name));

async function whole() {
  const directory = join(folder, 'rotated');
  const server = await start('[record]\nfile_s = 3\nkeep_free_mb = 1\n', ['--record', directory]);
  try {
    const { sessionId } = await server.client(SessionService).join({ displayName: 'Ann' });
    await sleep(1500);
    const target = { target: { case: 'pointInWorldM', value: { x: 0.1, y: 0, z: 0 } } };
    const draft = { shape: AnnotationShape.NOTE, text: 'valve', target };
    await server.client(AnnotationService).create({ sessionId, draft });
    const requestId = '6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11';
    await server.client(TalkService).say({ sessionId, requestId, text: 'look here' });
    await sleep(6500);
    const { recording } = await server.client(RecordingService).getRecording({});
    check(
      'what goes on is said',
      recording.on && recording.messages > 100n && recording.file.startsWith(directory),
      `${recording.messages} messages, ${recording.bytes} bytes, ${recording.eventsLost} lost`,
    );
    const stopped = await server.cli('recording', 'stop');
    check('it is ended by the command line', stopped.code === 0, stopped.out.trim() + stopped.err);
  } finally {
    await server.stop();
  }
  const files = filesOf(directory);
  check('another file begins when one is long enough', files.length >= 2, `${files.length} files`);
  let texts = '';
  let frames = [];
  let placedInAll = 0;
  for (const file of files) {
    const read = await readWhole(file);
    const pictures = read.of('/saccade/picture').map(({ value }) => value);
    const video = read.of('/camera/video').map(({ value }) => value);
    const map = read.of('/saccade/map').map(({ value }) => value);
    const placed = read.of('/tf').length;
    placedInAll += placed;
    frames = frames.concat(pictures.map(({ frameId }) => frameId));
    const begins = video.length > 0 ? nalTypes(video[0].data) : [];
    check(
      'a file stands for itself: a key frame and the whole map first, every message as its schema says',
      read.counted &&
        video.length === pictures.length &&
        video.length > 10 &&
        video.every(({ format, data }) => format === 'h264' && data.length > 0) &&
        [7, 8, 5].every((type) => begins.includes(type)) &&
        map.length > 0 &&
        map.some(({ full }) => full) &&
        read.of('/camera/calibration').length > 0 &&
        read.metadata.length === 1,
      `${video.length} pictures, ${read.of('/saccade/pose').length} poses (${placed} placed), ` +
        `${map.length} map deltas, ${read.of('/map/points').length} clouds; begins with ${begins}`,
    );
    check(
      'it is sought in by its index',
      read.soughtMs < 300 && read.soughtNs >= 0n && read.soughtNs < 500_000_000n,
      `${read.soughtMs.toFixed(1)} ms`,
    );
    for (const topic of ['/saccade/annotations', '/saccade/chat', '/saccade/presence']) {
      for (const { value } of read.of(topic)) {
        texts += JSON.stringify(value, (_, each) => (typeof each === 'bigint' ? `${each}` : each));
      }
    }
  }
  const last = await readWhole(files.at(-1));
  await exported(files.at(-1), last);
  await replayed(files.at(-1), last);
  check(
    'pictures are whole and in order over all files',
    rises(frames) && placedInAll > 10,
    `${frames.length} pictures, ${placedInAll} placed`,
  );
  const told = ['valve', 'look here', '"recording"'].filter((text) => texts.includes(text));
  check('marks, what was said, and who was there', told.length === 3, told.join(', '));
}

async function killed() {
  const server = await start('[record]\nkeep_free_mb = 1\n');
  const started = await server.cli('recording', 'start');
  const { file } = JSON.parse(started.out || '{}');
  await sleep(4000);
  const { pid } = server;
  const killedMs = Date.now();
  process.kill(pid, 'SIGKILL');
  await sleep(300);
  const read = readCut(file);
  const lostMs = killedMs - Number(read.lastNs / 1_000_000n);
  check(
    'after kill -9 all but the last second is read',
    !read.ended && read.of('/camera/video').length > 20 && lostMs < 1000,
    `${lostMs} ms are missing of ${read.of('/camera/video').length} pictures`,
  );
  await exported(file, read);
}

/** By the command line: poses and map in the forms of others, also of what was cut off. */
async function exported(file, read) {
  const out = join(folder, `exported-${read.ended}`);
  const run = (...words) =>
    new Promise((resolve) => {
      execFile(options.cli, ['replay', file, '--out', out, ...words], (error, text, err) =>
        resolve({ code: error?.code ?? 0, text: text + err }),
      );
    });
  const tum = await run('--export', 'tum');
  const ply = await run('--export', 'ply');
  const glb = await run('--export', 'glb');
  const lines = (name) => readFileSync(join(out, name), 'utf8').trim().split('\n');
  const poses =
    tum.code === 0 ? lines('trajectory.tum').filter((each) => !each.startsWith('#')) : [];
  const vertices = ply.code === 0 ? lines('map.ply').slice(9).length : 0;
  const clouds = read.of('/map/points');
  const points = clouds.length > 0 ? clouds.at(-1).value.data.length / 12 : 0;
  check(
    `poses and map are exported${read.ended === false ? ' from what was cut off' : ''}`,
    poses.length === read.of('/tf').length &&
      poses.every((each) => each.split(' ').length === 8) &&
      vertices > 0 &&
      Math.abs(vertices - points) <= 0.6 * points,
    `${poses.length} poses, ${vertices} features where the last cloud has ${points}; ${tum.text.trim()}`,
  );
  const told = read.of('/saccade/surface').flatMap(({ value }) => value.chunks);
  if (!told.some(({ triangleCount }) => triangleCount > 0)) return; // none was found yet
  const file0 = glb.code === 0 ? readFileSync(join(out, 'scene.glb')) : Buffer.alloc(20);
  const words = file0.subarray(20, 20 + file0.readUInt32LE(12)).toString();
  const triangles = Number(/: (\d+) triangles/.exec(glb.text)?.[1] ?? 0);
  check(
    'surfaces and marks are exported as glTF',
    file0.subarray(0, 4).toString() === 'glTF' && /"surfaces"/.test(words) && triangles > 0,
    glb.text.trim(),
  );
}

/** What somebody hears who watches. */
async function listen(server) {
  const session = server.client(SessionService);
  const { sessionId } = await session.join({ displayName: 'Bo' });
  const topics = [Topic.POSE, Topic.VIDEO, Topic.MAP, Topic.ANNOTATION];
  const heard = { poses: 0, pictures: [], features: new Set(), texts: '' };
  const stop = new AbortController();
  const read = async () => {
    for await (const { sequence, event } of session.subscribe(
      { sessionId, topics },
      { signal: stop.signal },
    )) {
      session.acknowledge({ sessionId, sequence }).catch(() => undefined);
      if (event.case === 'accessUnit')
        heard.pictures.push({ ...event.value, ms: performance.now() });
      if (event.case === 'pose') ++heard.poses;
      if (event.case === 'map') for (const { id } of event.value.upserted) heard.features.add(id);
      if (event.case === 'annotation') {
        for (const { text } of event.value.upserted) heard.texts += text;
      }
    }
  };
  heard.done = read().catch(() => undefined);
  heard.stop = () => stop.abort();
  return heard;
}

/** The recording in the place of a camera: seen as it was, paused, sought in, faster. */
async function replayed(file, recorded) {
  const server = await start('[record]\nkeep_free_mb = 1\n', [], `replay:${file}`);
  try {
    const heard = await listen(server);
    const replay = server.client(ReplayService);
    await sleep(500);
    await replay.changeReplay({ positionS: 0 }); // who comes in between waits for the next key frame
    await sleep(1500);
    await replay.changeReplay({ playing: false });
    await sleep(300);
    const still = heard.pictures.length;
    const poses = heard.poses;
    await sleep(1200);
    const same = new Set(recorded.of('/camera/video').map(({ value }) => value.data.join()));
    check(
      'what was recorded is seen again, to the byte, and stands still when asked to',
      still > 5 &&
        heard.pictures.length === still &&
        heard.poses > poses && // nobody is to think that the camera is away
        heard.pictures[0].keyFrame &&
        heard.pictures.every(({ data }) => same.has(data.join())) &&
        heard.features.size > 10 &&
        heard.texts.includes('valve'),
      `${still} pictures, ${heard.features.size} features, marks: ${heard.texts}`,
    );
    const { replay: whole } = await replay.getReplay({});
    const took = [];
    for (const share of [0.7, 0.1, 0.5]) {
      const before = heard.pictures.length;
      const begin = performance.now();
      await replay.changeReplay({ positionS: share * whole.lengthS });
      while (heard.pictures.length === before && performance.now() - begin < 5000) await sleep(1);
      took.push(performance.now() - begin);
    }
    check(
      'sought while it stands still, the picture is there in 300 ms',
      took.every((ms) => ms < 300),
      took.map((ms) => `${ms.toFixed(0)} ms`).join(', '),
    );
    const ids = heard.pictures.map(({ frameId }) => frameId);
    check('frame ids rise, wherever it goes', rises(ids), `${ids.length} pictures`);
    await server.cli('playback', 'seek', '0');
    await server.cli('playback', 'speed', '4');
    const fast = await server.cli('playback', 'play');
    const begin = performance.now();
    let at = JSON.parse(fast.out || '{}');
    while (at.playing && performance.now() - begin < 10_000) {
      await sleep(50);
      at = JSON.parse((await server.cli('playback', 'status')).out);
    }
    const seconds = (performance.now() - begin) / 1000;
    check(
      'four times as fast it ends in a quarter of the time, and stands at its end',
      seconds < 0.25 * whole.lengthS + 1 &&
        seconds > 0.2 * whole.lengthS - 0.5 &&
        Math.abs(at.position_s - whole.lengthS) < 0.2,
      `${whole.lengthS.toFixed(1)} s in ${seconds.toFixed(1)} s`,
    );
    const { sessionId } = await server.client(SessionService).join({ displayName: 'Cy' });
    const refused = await server
      .client(AnnotationService)
      .create({
        sessionId,
        draft: {
          shape: AnnotationShape.NOTE,
          text: 'late',
          target: { target: { case: 'pointInWorldM', value: { x: 0.1, y: 0, z: 0 } } },
        },
      })
      .then(
        () => '',
        (error) => error.rawMessage,
      );
    check('nothing of it is changed', /recording/.test(refused), refused);
    heard.stop();
    await heard.done;
  } finally {
    await server.stop();
  }
}

async function fullDisk() {
  const server = await start('[record]\nkeep_free_mb = 1099511627776\n', [
    ...['--record', join(folder, 'full')],
  ]);
  try {
    await sleep(500);
    const { recording } = await server.client(RecordingService).getRecording({});
    const again = await server.cli('recording', 'start');
    const alive = await server.cli('status');
    check(
      'without room nothing is recorded, that is said, and the server serves',
      !recording.on &&
        /make room/.test(recording.problem) &&
        again.code === 1 &&
        /keep_free_mb/.test(again.err) &&
        alive.code === 0,
      recording.problem,
    );
  } finally {
    await server.stop();
  }
}

try {
  await whole();
  await killed();
  await fullDisk();
} catch (error) {
  console.error(error);
  ++failures;
}
rmSync(folder, { recursive: true, force: true });
process.exit(failures > 0 ? 1 : 0);
