// T33 on the page: which pixels of the overlay show a virtual box, against rays.
import { SceneMaterial, SceneShape } from '../../src/gen/saccade/v1/scene_pb.js';
import { inWorld, minus, rotate, unproject } from './optics.mjs';
import { shot, when, WALL_Z } from './things.mjs';

const BIAS_M = 0.005;
const STEP_PX = 2;
const DRAWN = 200; // alpha: shadows have less
const LEAST_SEEN_IOU = 0.99;
const LEAST_HIDDEN_IOU = 0.98;

/** Alpha of the overlay and the pose it was drawn from, in one go. */
const overlay = ({ ann }) =>
  ann.page.evaluate(
    () =>
      new Promise((resolve) => {
        // After the page's own frame, before the browser takes the canvas away.
        window.requestAnimationFrame(() => {
          const canvas = document.querySelector('canvas.scene');
          if (!canvas || canvas.hidden || !canvas.dataset.pose) return resolve(undefined);
          const copy = new window.OffscreenCanvas(canvas.width, canvas.height);
          const context = copy.getContext('2d');
          context.drawImage(canvas, 0, 0);
          const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
          let alpha = '';
          for (let i = 3; i < data.length; i += 4) alpha += String.fromCharCode(data[i]);
          resolve({ alpha, width: canvas.width, height: canvas.height, pose: canvas.dataset.pose });
        });
      }),
  );

/** How far along the ray an upright box is entered, by its slabs; Infinity: it is missed. */
function enters({ base: [x, y, z], size }, origin, way) {
  const low = [x - size[0] / 2, y - size[1], z - size[2] / 2];
  let [enter, leave] = [-Infinity, Infinity];
  for (const axis of [0, 1, 2]) {
    const ends = [low[axis], low[axis] + size[axis]].map((end) => (end - origin[axis]) / way[axis]);
    enter = Math.max(enter, Math.min(...ends));
    leave = Math.min(leave, Math.max(...ends));
  }
  return enter <= leave && enter > 0 ? enter : Infinity;
}

const toObject = ({ base, size }, name, material) => ({
  ...{ name, shape: SceneShape.BOX, material, colorRgba: 0xff8800ff },
  sizeM: { x: size[0], y: size[1], z: size[2] },
  parentFromObject: {
    rotation: { x: 0, y: 0, z: 0, w: 1 },
    translationM: { x: base[0], y: base[1], z: base[2] },
  },
});

export function score({ alpha, width, height, pose }, intrinsics, thing, real) {
  const [x, y, z, ...rotation] = pose.split(' ').map(Number);
  const camera = { ...intrinsics, distortion: [...intrinsics.distortion] };
  const counts = { seen: [0, 0], hidden: [0, 0], thin: 0 };
  const add = (count, a, b) => {
    count[0] += a && b ? 1 : 0;
    count[1] += a || b ? 1 : 0;
  };
  for (let v = 0; v < height; v += STEP_PX) {
    for (let u = 0; u < width; u += STEP_PX) {
      const way = rotate(rotation, unproject(camera, [u, v], 1)); // a length of it is a depth
      const depth = enters(thing, [x, y, z], way);
      const depths = real.map((box) => enters(box, [x, y, z], way));
      const meant = depth < Infinity;
      const seen = meant && depth < Math.min(...depths) + BIAS_M;
      const shown = alpha.charCodeAt(v * width + u) > DRAWN;
      if (seen && Math.min(...depths) < depth) ++counts.thin;
      add(counts.seen, seen, shown);
      add(counts.hidden, meant && !seen, meant && !shown);
    }
  }
  return counts;
}

/** A virtual box behind one real one, cut by another, with a third 3 mm before its face. */
export async function occluded(context) {
  const { ann, scene, sessionId, check, intrinsics } = context;
  const boxes = [];
  const put = async (box, name, material) => {
    const { object } = await scene.putObject({ sessionId, object: toObject(box, name, material) });
    boxes.push(object.id);
  };
  const far = { base: [0, -50, 0], size: [0.1, 0.1, 0.1] };
  await put(far, 'beacon', SceneMaterial.VIRTUAL); // so that there is something to draw
  await ann.enlarge('video');
  const first = await when(() => overlay(context), 30_000);
  const [x, y, z, ...rotation] = first.pose.split(' ').map(Number);
  const pose = { translation_m: [x, y, z], rotation_xyzw: rotation };
  const axis = rotate(rotation, [0, 0, 1]);
  const d = (WALL_Z - z) / axis[2];
  const at = (right, down, ahead) => inWorld(pose, [right * d, down * d, ahead * d]);
  const sized = (...sizes) => sizes.map((share) => share * d);
  const thing = { base: at(0.05, 0.22, 0.75), size: sized(0.42, 0.44, 0.2) };
  const front = thing.base[2] - thing.size[2] / 2;
  const slab = { base: at(0.12, -0.02, 0.6), size: sized(0.1, 0.1, 0.01) };
  slab.base[2] = front - 0.003 + slab.size[2] / 2;
  const real = [
    { base: at(-0.06, 0.2, 0.5), size: sized(0.1, 0.3, 0.06) },
    { base: at(0.2, 0.24, 0.72), size: sized(0.12, 0.25, 0.3) },
    slab,
  ];
  await put(thing, 'thing', SceneMaterial.VIRTUAL);
  for (const [i, box] of real.entries()) await put(box, `real ${i}`, SceneMaterial.REAL);
  const layer = ann.page.locator('.scene-layer');
  await when(async () => (await layer.getAttribute('data-things')) === '6');
  const drawn = await when(async () => {
    const now = await overlay(context); // meshes are made a picture later
    return now && [...now.alpha].some((one) => one.charCodeAt(0) > DRAWN) && now;
  }, 40_000);
  if (!drawn) return check('what is real hides a virtual box (T33)', false, 'nothing is drawn');
  const { seen, hidden, thin } = score(drawn, intrinsics, thing, real);
  const [seenIou, hiddenIou] = [seen, hidden].map(([both, either]) => both / either);
  check(
    'what is real hides a virtual box as rays say (T33)',
    seenIou >= LEAST_SEEN_IOU && hiddenIou >= LEAST_HIDDEN_IOU && seen[1] > 1500 && thin > 50,
    `seen ${seenIou.toFixed(4)} of ${seen[1]} px, hidden ${hiddenIou.toFixed(4)} of ${hidden[1]} px, ` +
      `within the bias ${thin} px, apart ${minus(thing.base, real[0].base)[2].toFixed(2)} m`,
  );
  await shot(context, 'occluded');
  for (const id of boxes) await scene.removeObject({ sessionId, id });
  await ann.enlarge('map');
}
