import { Camera } from './camera';

/** A camera without distortion that sees all of the picture of another, pixel for pixel in its middle. */
export function pinholeAround(camera: Camera): Camera {
  const { width, height, fx, fy } = camera.intrinsics;
  let left = 0;
  let right = 0;
  let top = 0;
  let bottom = 0;
  const cover = (u: number, v: number): void => {
    const ray = camera.unproject({ u, v });
    if (!ray || ray.z < 0.05) return;
    left = Math.min(left, ray.x / ray.z);
    right = Math.max(right, ray.x / ray.z);
    top = Math.min(top, ray.y / ray.z);
    bottom = Math.max(bottom, ray.y / ray.z);
  };
  for (let u = 0; u < width; u++) {
    cover(u, 0);
    cover(u, height - 1);
  }
  for (let v = 0; v < height; v++) {
    cover(0, v);
    cover(width - 1, v);
  }
  const border = 2; // pixels beyond the last one needed
  const cx = border - left * fx;
  const cy = border - top * fy;
  return new Camera({
    model: 'pinhole',
    width: Math.ceil(cx + right * fx + border) + 1,
    height: Math.ceil(cy + bottom * fy + border) + 1,
    ...{ fx, fy, cx, cy, distortion: [] },
  });
}

/**
 * OpenGL's projection of a pinhole camera for eyes that look along -z with y up, row by row; pixel (0, 0) is
 * the centre of the top left one.
 */
export function clipFromEye(camera: Camera, near: number, far: number): readonly number[] {
  const { width, height, fx, fy, cx, cy } = camera.intrinsics;
  return [
    ...[(2 * fx) / width, 0, 1 - (2 * (cx + 0.5)) / width, 0],
    ...[0, (2 * fy) / height, (2 * (cy + 0.5)) / height - 1, 0],
    ...[0, 0, -(far + near) / (far - near), (-2 * far * near) / (far - near)],
    ...[0, 0, -1, 0],
  ];
}
