// What a click in the live picture truly fell on, by the simulator's own depth of that very frame.
import { inCamera, inWorld, length, minus, unproject } from './optics.mjs';

const AIM_PX = 15; // a click farther than this from its object missed it
const OUTLINE_PX = 3; // within this of an outline a click may mean either side of it
const OUTLINE_SHARE = 0.03; // of the depth: what makes an outline

/** Whether depths differ by an outline's step within reach of a pixel; beyond the picture nothing is. */
export function atOutline(depths, [u, v]) {
  const around = [];
  for (let dv = -OUTLINE_PX; dv <= OUTLINE_PX; ++dv) {
    for (let du = -OUTLINE_PX; du <= OUTLINE_PX; ++du) around.push(depths.at([u + du, v + dv]));
  }
  const known = around.filter((depth) => depth > 0);
  return Math.max(...known) - Math.min(...known) > OUTLINE_SHARE * Math.min(...known);
}

/**
 * The point in the world [m] and its depth [m] that a press showed; undefined where it missed its object or fell
 * on an outline. `depthsOf` (renderDepths of server.mjs) gives a frame's depths.
 */
export async function clickedPoint({ id, pixel }, truth, camera, name, depthsOf) {
  const frame = truth.frame(id);
  const object = frame?.objects.find((entry) => entry.name === name);
  if (!object?.pixel || !object.visible || length(minus(object.pixel, pixel)) > AIM_PX) {
    return undefined;
  }
  const depths = await depthsOf(id);
  const depth = depths.at(pixel);
  const meant = inCamera(frame.world_from_camera, object.point_in_world_m)[2];
  // Beside its object on something else: it was missed by less than AIM_PX, but missed.
  if (!(depth > 0) || Math.abs(depth - meant) > 0.1 * meant) return undefined;
  if (atOutline(depths, pixel)) return undefined;
  return { point: inWorld(frame.world_from_camera, unproject(camera, pixel, depth)), depth };
}
