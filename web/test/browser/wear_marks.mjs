// Things clicked in the expert's video and map, and where the phone draws them over its own picture.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { aimInMap } from './checks.mjs';
import { inCamera, inWorld, length, minus, project, similarity, unproject } from './optics.mjs';
import { median } from './pictures.mjs';

export const BITS = 9; // of a picture's number
export const BLOCK = { width: 16, height: 8 }; // of a bit, in the uppermost rows: no feature is looked for there
export const MARKS = Number(process.env['SACCADE_MARKS'] ?? 3);
const IN_MAP = MARKS < 10 ? 0 : Math.floor(MARKS / 3); // the few of every run are placed in the video
const MARK_MS = 30_000; // for one, with misses
const AIM_PX = 15; // a click farther than this from its object missed it: taken back, tried again
const VIDEO_PX = 8;
const MAP_PX = 21; // four per cent of depth: a click in the map takes what the map has near it

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** The number that the shown picture carries, and what the page says belongs to it, read in one go. */
const shownBy = (page) =>
  page.evaluate(
    ({ bits, width, height }) => {
      const picture = document.querySelector('canvas.picture');
      const { data } = picture.getContext('2d').getImageData(0, 0, bits * width, height);
      let number = 0;
      for (let i = 0; i < bits; ++i) {
        let sum = 0;
        for (let v = 2; v < height - 2; ++v) {
          for (let u = 4; u < width - 4; ++u) sum += data[4 * (v * bits * width + i * width + u)];
        }
        if (sum / ((height - 4) * (width - 8)) > 128) number |= 1 << i;
      }
      const marks = document.querySelector('canvas.marks');
      const said = (marks?.dataset.marks ?? '')
        .split(',')
        .map((words) => words.split(' ').map(Number));
      return { number, frameId: Number(picture.dataset.frameId), marks: said };
    },
    { bits: BITS, ...BLOCK },
  );

/** Clicks objects in the expert's video; the phone draws the marks over its own picture. */
export async function marks(context) {
  const { expert, phone, truth, check } = context;
  await expert.press('c');
  await expert.enlarge('video');
  const placed = [];
  for (const end = Date.now() + MARK_MS * MARKS; placed.length < MARKS && Date.now() < end; ) {
    if (placed.length === MARKS - IN_MAP) await expert.enlarge('map');
    const mark =
      placed.length < MARKS - IN_MAP
        ? await placeMark(context, placed)
        : await placeInMap(context, placed);
    if (mark) placed.push(mark);
  }
  await expert.enlarge('video');
  // On the phone, over its own picture: where each mark is, against where truth has it in that very picture.
  const errors = placed.map(() => []);
  const seen = new Set();
  for (const end = Date.now() + 10_000; Date.now() < end; await sleep(30)) {
    const shown = await shownBy(phone.page);
    const frame = truth.frame(shown.number);
    if (!frame || !shown.frameId || seen.has(shown.frameId)) continue;
    seen.add(shown.frameId);
    placed.forEach(({ point }, i) => {
      const at = project(context.camera, inCamera(frame.world_from_camera, point));
      if (!at || at[0] < 0 || at[1] < 0 || at[0] > 639 || at[1] > 479) return;
      const away = shown.marks.map((pixel) => length(minus(pixel, at))).filter((px) => px >= 0);
      if (away.length > 0) errors[i].push(Math.min(...away));
    });
  }
  const each = errors.map((list) => median(list));
  const objects = new Set(placed.map(({ name }) => name)).size;
  const good = each.map((error, i) => error < (i < MARKS - IN_MAP ? VIDEO_PX : MAP_PX));
  check(
    `${MARKS} marks placed in the expert's video (${IN_MAP} of them in the map) are where truth has them on the phone`,
    placed.length === MARKS && good.every(Boolean) && seen.size > 10,
    `${placed.length} marks on ${objects} objects, ${seen.size} pictures, median by mark ${each.map((e) => e?.toFixed(1)).join(', ')} px`,
  );
}

/** One cube on an object; undefined if it was missed, as the camera moves on, or refused. */
async function placeMark({ expert, truth, camera }, placed) {
  const numbers = new Map(); // of the expert's frames
  const look = async () => {
    const { frameId, number } = await shownBy(expert.page);
    numbers.set(frameId, number);
    return number;
  };
  const { left, top, scale, width, height } = await expert.look();
  const used = (name) => placed.filter((mark) => mark.name === name).length;
  const target = truth
    .frame(await look())
    ?.objects.filter(({ visible, pixel }) => {
      if (!visible || !pixel) return false;
      const [u, v] = pixel;
      return u > 60 && v > 60 && u < width - 60 && v < height - 60;
    })
    .sort((a, b) => used(a.name) - used(b.name))[0];
  if (!target) return undefined;
  const before = await expert.annotationIds();
  const [u, v] = target.pixel;
  const looking = (async () => {
    for (let i = 0; i < 8; ++i) await look();
  })();
  await expert.click([left + (u + 0.5) * scale, top + (v + 0.5) * scale]);
  await looking;
  const { id, refused } = await expert.newAnnotation(before);
  if (!id) {
    if (process.env['SACCADE_VERBOSE']) console.log(`      ${target.name}: ${refused}`);
    return undefined;
  }
  const { id: frameId, pixel } = await expert.pressed();
  const frame = truth.frame(numbers.get(frameId));
  const object = frame?.objects.find(({ name }) => name === target.name);
  if (object?.pixel && object.visible && length(minus(object.pixel, pixel)) < AIM_PX) {
    const depth = inCamera(frame.world_from_camera, object.point_in_world_m)[2];
    const point = inWorld(frame.world_from_camera, unproject(camera, pixel, depth));
    return { id, name: target.name, point };
  }
  await expert.press('Control+z'); // missed
  await sleep(500);
  return undefined;
}

/**
 * One cube by the map, on an object of which the map has something. A phone's map has a frame and a scale of its
 * own: the marks that stand already say which.
 */
async function placeInMap(context, placed) {
  const { expert, truth, saccade, whom, folder } = context;
  const file = join(folder, 'map.ply');
  saccade(...whom, 'map', '--out', file);
  const upserted = pointsOf(readFileSync(file, 'latin1'));
  const standing = new Map(
    JSON.parse(saccade(...whom, '--json', 'annotations', 'list')).map(({ id, anchor }) => [
      id,
      anchor.point_in_world_m,
    ]),
  );
  const inVideo = placed.filter(({ byMap }) => !byMap);
  const inMap = similarity(
    inVideo.map(({ point }) => point),
    inVideo.map(({ id }) => standing.get(id)),
  );
  const { number } = await shownBy(expert.page);
  const frame = truth.frame(number);
  if (!frame) return undefined;
  const objects = frame.objects.map((object) => ({
    ...object,
    point_in_world_m: inMap(object.point_in_world_m),
  }));
  const before = await expert.annotationIds();
  const click = await aimInMap(
    {
      expert,
      truth: { frame: () => ({ ...frame, objects }) },
      map: { get: () => Promise.resolve({ map: { upserted } }) },
    },
    new Map(placed.map(({ name }) => [name, placed.filter((mark) => mark.name === name).length])),
  );
  if (!click) return undefined;
  const { id } = await expert.newAnnotation(before);
  const point = frame.objects.find(({ name }) => name === click.name).point_in_world_m;
  return id && { id, name: click.name, point, byMap: true };
}

/** Of a PLY file in words. */
function pointsOf(ply) {
  const lines = ply.slice(ply.indexOf('end_header')).split('\n').slice(1);
  return lines.filter(Boolean).map((line) => {
    const [x, y, z] = line.split(' ').map(Number);
    return { depthKnown: true, pointInWorldM: { x, y, z } };
  });
}
