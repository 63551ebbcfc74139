// Twenty cubes, ten by the video and ten by the map, while the wearer moves: the same script as the
// browser's test (web/test/browser/checks.mjs), and its figures.
import { clickedPoint } from '../../web/test/browser/clicked.mjs';
import { inCamera, length, minus, project } from '../../web/test/browser/optics.mjs';
import { median } from '../../web/test/browser/pictures.mjs';

const PER_PANE = 10;
const MAPPED_M = 0.05; // in the map one can only click what it shows: a feature this near to the object
const LIVE_HZ = 15;
const PER_OBJECT = 2; // in the video: where few are in view for long, two edges would be half of all

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** What the median of clicks may be off, as a share of the depth: more where the tracker got few pictures. */
export function accuracyBar({ hz }) {
  const tracked = median(hz);
  const share = tracked < LIVE_HZ ? 0.05 : 0.02;
  return {
    share,
    words: `${100 * share} % of depth (${tracked.toFixed(0)} pictures tracked a second)`,
  };
}

export async function clicks(context) {
  const { desktop, screen, check, annotations } = context;
  context.placed = [];
  context.hz = [];
  screen.press('c');
  await desktop.until('the cube is in hand', ({ tool }) => tool === 'Cube');
  await desktop.enlarge('video');
  await placeMany(context, 'video', aimInVideo);
  context.shot('video');
  await desktop.enlarge('map');
  await placeMany(context, 'map', aimInMap);
  context.shot('map');
  screen.press('v');
  await sleep(1000);
  const known = new Map(annotations().map(({ id, anchor }) => [id, anchor]));
  const bar = accuracyBar(context);
  context.share = bar.share;
  for (const pane of ['video', 'map']) {
    const placed = context.placed.filter((entry) => entry.pane === pane);
    const errors = placed.map(({ id, name, point, depth }) => {
      const at = known.get(id)?.point_in_world_m;
      const error = at ? length(minus(at, point)) : Infinity;
      console.log(
        `      ${pane} ${name}: ${(1000 * error).toFixed(1)} mm at ${depth.toFixed(2)} m, ` +
          `${((100 * error) / depth).toFixed(2)} %, ${known.get(id)?.method}`,
      );
      return error / depth;
    });
    const objects = new Set(placed.map(({ name }) => name)).size;
    check(
      `clicks in the ${pane}, ${PER_PANE} of ${PER_PANE} placed, median error below ${bar.words}`,
      placed.length >= PER_PANE && median(errors) < bar.share,
      `${placed.length} cubes on ${objects} objects, median ${(100 * median(errors)).toFixed(2)} %, ` +
        `worst ${(100 * Math.max(...errors)).toFixed(2)} %, ` +
        `${errors.filter((error) => error < bar.share).length} each below`,
    );
  }
}

async function placeMany(context, pane, aim) {
  const { desktop, screen, placed } = context;
  const used = new Map(); // object -> how often
  const refusals = [];
  let count = 0;
  for (const end = Date.now() + 300_000; count < PER_PANE && Date.now() < end; ) {
    const before = new Set(desktop.look().marks.map(({ id }) => id));
    const click = await aim(context, used);
    if (!click) {
      await sleep(100);
      continue;
    }
    const { id, refused } = await newMark(desktop, before, pane);
    if (refused) {
      refusals.push(refused);
      await sleep(500);
      continue;
    }
    used.set(click.name, (used.get(click.name) ?? 0) + 1);
    const hit = await click.where();
    if (!hit) {
      screen.press('ctrl+z'); // missed: the wearer had moved on
      await desktop.until(
        'the miss is undone',
        ({ marks }) => !marks.some((mark) => mark.id === id),
      );
      continue;
    }
    context.hz.push(desktop.look().tracked_hz ?? 0);
    placed.push({ id, pane, name: click.name, ...hit });
    ++count;
  }
  if (refusals.length > 0) console.log(`      refused ${refusals.length}: ${refusals[0]}`);
}

/** Waits for a mark that was not there before; its id, or why there is none. */
async function newMark(desktop, before, pane) {
  for (const end = Date.now() + 8000; Date.now() < end; await sleep(20)) {
    const { marks, refused } = desktop.look();
    const added = marks.find(({ id }) => !before.has(id));
    if (added) return { id: added.id };
    if (refused[pane]) {
      const why = refused[pane];
      await desktop.until('the refusal has been read', (shown) => shown.refused[pane] === '');
      return { refused: why };
    }
  }
  return { refused: 'no answer' };
}

/** Objects with their truth in a frame, least used first. */
const candidates = (frame, used) =>
  frame.objects
    .filter(({ visible, pixel }) => visible && pixel)
    .sort((a, b) => (used.get(a.name) ?? 0) - (used.get(b.name) ?? 0));

/** True where the inset lies over the large pane there. */
export const covered = ({ inset: [x, y, w, h] }, [u, v]) =>
  u > x - 10 && u < x + w + 10 && v > y - 10 && v < y + h + 10;

async function aimInVideo({ desktop, screen, truth, depths }, used) {
  const shown = desktop.look();
  const { frame: id, left, top, scale, width, height, camera } = shown.video;
  const frame = truth.frame(id);
  if (!frame) return undefined;
  for (const { name, pixel } of candidates(frame, used)) {
    if ((used.get(name) ?? 0) >= PER_OBJECT) continue;
    const [u, v] = pixel;
    if (u < 30 || v < 30 || u > width - 30 || v > height - 30) continue;
    const at = [left + (u + 0.5) * scale, top + (v + 0.5) * scale];
    if (covered(shown, at)) continue;
    screen.click(at);
    return {
      name,
      where: () => {
        const [id, ...pressed] = desktop.look().pressed;
        return clickedPoint({ id, pixel: pressed }, truth, camera, name, depths);
      },
    };
  }
  return undefined;
}

/** As a person would: turn the wheel over the object until it is near, then click it. */
async function aimInMap(context, used) {
  const { desktop, screen, truth } = context;
  const frame = truth.frame(desktop.look().video.frame);
  if (!frame) return undefined;
  screen.press('h');
  await sleep(400);
  const names = mappedOf(context, candidates(frame, used)).map(({ name }) => name);
  const found = findInMap(desktop.look(), frame, names);
  if (!found) return undefined;
  screen.move(found.at);
  screen.input('click', '--repeat', '8', '--delay', '10', '4');
  await sleep(700);
  const near = findInMap(desktop.look(), frame, [found.name]);
  if (!near) return undefined;
  screen.click(near.at);
  const depth = inCamera(frame.world_from_camera, near.point)[2];
  return { name: near.name, where: () => ({ point: near.point, depth }) };
}

/** Of these objects those that the map shows something of. */
function mappedOf({ map }, objects) {
  const points = map()
    .features.filter(({ depth_known }) => depth_known)
    .map(({ point_in_world_m }) => point_in_world_m);
  return objects.filter(({ point_in_world_m: at }) =>
    points.some((point) => length(minus(point, at)) < MAPPED_M),
  );
}

/** Where the first of these objects that can be clicked lies on the screen. */
function findInMap(shown, frame, names) {
  const {
    pane: [x, y, width, height],
    eye: [tx, ty, tz, ...rotation],
    focal,
  } = shown.map;
  const lens = { fxPx: focal, fyPx: focal, cxPx: width / 2, cyPx: height / 2, distortion: [] };
  const pose = { translation_m: [tx, ty, tz], rotation_xyzw: rotation };
  for (const name of names) {
    const { point_in_world_m: point } = frame.objects.find((object) => object.name === name);
    const pixel = project(lens, inCamera(pose, point));
    if (!pixel || pixel[0] < 20 || pixel[1] < 20 || pixel[0] > width - 20 || pixel[1] > height - 20)
      continue;
    const at = [x + pixel[0], y + pixel[1]];
    if (!covered(shown, at)) return { name, point, at };
  }
  return undefined;
}
