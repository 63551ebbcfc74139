// A frozen picture: is it that frame, its grey to the bit, and do clicks in it land where that frame saw things,
// also when it is older than the ring and the server holds it as a fetched still?
import { VideoView } from '../../src/gen/saccade/v1/video_pb.js';
import { inCamera, length, minus } from './optics.mjs';
import { AT_OUTLINES } from './outlines.mjs';
import { decodePng, greyOf, median, psnr } from './pictures.mjs';

const OBJECTS = 5; // clicked at once, and again when the frame is gone; of three, two may lie on outlines
const RING_S = 10; // how long the server keeps a frame
const CLAIMED_SHARE = 0.1; // of the depth: who claims more makes no promise to be held to

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * Freezes a picture whose camera is known, as a person would who sees the status: in another one nothing can
 * be placed, and the page says so. A loaded computer loses the camera now and then.
 */
async function freeze({ expert, truth }, still) {
  for (let tries = 0; ; ++tries) {
    await expert.waitForStatus(/^tracking/, 60_000);
    await expert.press('v');
    await expert.press('p');
    await still.waitFor({ timeout: 10_000 });
    const id = Number(await still.getAttribute('data-frame-id'));
    await expert.press('c');
    const [first] = await placeOn(expert, truth.frame(id), 1);
    await expert.press('v');
    if (first && !first.refused) {
      await expert.press('Control+z');
      return id;
    }
    if (tries === 5) throw new Error(`no frame could be frozen: ${first?.refused ?? 'no object'}`);
    await expert.press('p');
    await sleep(1000);
  }
}

export async function frozenPicture(context) {
  const { expert, session, annotations, truth, check } = context;
  const { share = 0.02 } = context; // of the depth, as for clicks in the live picture
  await expert.enlarge('video');
  const still = expert.page.locator('canvas.still[data-lossless]');
  const id = await freeze(context, still);
  const url = await still.evaluate((canvas) => canvas.toDataURL('image/png'));
  const kept = await session.getFrame({ frameId: BigInt(id), view: VideoView.RAW });
  const [shown, sent] = [decodePng(Buffer.from(url.split(',')[1], 'base64')), decodePng(kept.png)];
  const ratio = psnr(shown, sent);
  const greyRatio = psnr(greyOf(shown), greyOf(sent));
  const frame = truth.frame(id);
  await sleep(1000);
  const [live, marks] = [(await expert.look()).id, (await expert.marks()).id];
  check(
    // Kept frames have their grey bit by bit, their colour at half the resolution: the grey of three
    // rounded colours is off by less than a level.
    'frozen: the very frame, its marks, and the live picture goes on',
    Number(kept.frameId) === id && ratio > 35 && greyRatio > 50 && marks === id && live > id,
    `frame ${id}, PSNR ${ratio.toFixed(1)} dB, of its grey ${greyRatio.toFixed(1)} dB; ` +
      `marks of ${marks}, live at ${live}`,
  );

  for (const gone of [false, true]) {
    if (gone) await sleep(1000 * (RING_S + 1));
    await expert.press('c');
    const ids = await placeOn(expert, frame);
    await expert.press('v');
    await sleep(1000);
    const known = new Map(
      (await annotations.list({})).annotations.map(({ id: key, anchor }) => [key, anchor]),
    );
    const errors = ids.map(({ key, object }) => {
      const at = known.get(key)?.pointInWorldM;
      const depth = inCamera(frame.world_from_camera, object.point_in_world_m)[2];
      return at ? length(minus([at.x, at.y, at.z], object.point_in_world_m)) / depth : Infinity;
    });
    const claimed = ids.map(({ key, object }) => {
      const depth = inCamera(frame.world_from_camera, object.point_in_world_m)[2];
      return (known.get(key)?.errorMm ?? 0) / 1000 / depth;
    });
    const refused = ids.find((entry) => entry.refused)?.refused;
    // Where nothing but the wall behind has features, as on a plain tin, the mark itself says that it is not known.
    const vouched = errors.filter((_, i) => claimed[i] < CLAIMED_SHARE);
    check(
      `clicks in the frozen picture${gone ? ` after ${RING_S} s` : ''} that claim to be known, median error below ${100 * share} % of depth`,
      vouched.length > 0 && median(vouched) < share,
      refused ?? errors.map((e, i) => `${ids[i].object.name} ${(100 * e).toFixed(2)} %`).join(', '),
    );
    check(
      `a click in the frozen picture${gone ? ` after ${RING_S} s` : ''} that is off says so`,
      errors.every((error, i) => error < Math.max(0.02, 3 * claimed[i])),
      claimed.map((c, i) => `${ids[i].object.name} claims ${(100 * c).toFixed(2)} %`).join(', '),
    );
    for (let i = 0; i < ids.length; ++i) await expert.press('Control+z'); // leaves the room as it was
    await sleep(500);
  }
  await expert.press('p');
}

/** A cube on each of some objects that the frame shows. */
async function placeOn(expert, frame, count = OBJECTS) {
  const { left, top, scale, width, height } = await expert.look();
  const placed = [];
  for (const object of frame.objects) {
    if (placed.length === count) break;
    if (!object.visible || !object.pixel || AT_OUTLINES.includes(object.name)) continue;
    const [u, v] = object.pixel;
    if (u < 30 || v < 30 || u > width - 30 || v > height - 30) continue;
    const at = [left + (u + 0.5) * scale, top + (v + 0.5) * scale];
    if (!(await expert.isOver('.video', at))) continue;
    const before = await expert.annotationIds();
    await expert.click(at);
    const { id: key, refused } = await expert.newAnnotation(before);
    placed.push({ key, refused, object });
  }
  return placed;
}
