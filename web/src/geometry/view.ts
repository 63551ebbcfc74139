import type { Camera } from './camera';
import { inverse, type Rigid3, rotate, transform } from './rigid3';
import type { Pixel, Vec3 } from './vec3';

/** Somewhere to look from: the wearer's camera at one frame, or the eye above the 3D map. */
export interface View {
  readonly camera: Camera;
  readonly worldFromCamera: Rigid3;
  readonly cameraFromWorld: Rigid3;
}

export const makeView = (camera: Camera, worldFromCamera: Rigid3): View => ({
  camera,
  worldFromCamera,
  cameraFromWorld: inverse(worldFromCamera),
});

/** Where a point appears; undefined if it does not. May lie outside the picture. */
export const projectPoint = (view: View, pointInWorld: Vec3): Pixel | undefined => {
  const point = transform(view.cameraFromWorld, pointInWorld);
  return point.z > 0 ? view.camera.project(point) : undefined;
};

/** Distance in front of the eye [m]; negative behind. */
export const depthOf = (view: View, pointInWorld: Vec3): number =>
  transform(view.cameraFromWorld, pointInWorld).z;

/** Direction in world of a pixel's ray; its origin is the eye. */
export const rayOf = (view: View, pixel: Pixel): Vec3 | undefined => {
  const direction = view.camera.unproject(pixel);
  return direction && rotate(view.worldFromCamera.rotation, direction);
};

export const eyeOf = (view: View): Vec3 => view.worldFromCamera.translation;
