/** Clockwise quarter turns [deg]. */
export type Turn = 0 | 90 | 180 | 270;

export interface Size {
  readonly width: number;
  readonly height: number;
}

const wide = ({ width, height }: Size): boolean => width >= height;
export const swapped = ({ width, height }: Size): Size => ({ width: height, height: width });
export const swaps = (turn: Turn): boolean => turn % 180 !== 0;

/**
 * What turns a picture that a browser gives upright back to how the camera's sensor lies, so that a
 * turn of the phone is a turn of the camera and nothing else changes. `angle` is the screen's
 * (screen.orientation.angle: how far its content is turned against the phone); `taken`: the size of
 * the pictures that the server takes, which says how its sensor lies.
 */
export function turnOf(picture: Size, angle: number, taken: Size): Turn {
  const quarter = ((Math.round(angle / 90) % 4) + 4) % 4;
  const naturallyWide = quarter % 2 === 0 ? wide(picture) : !wide(picture);
  const from = naturallyWide === wide(taken) ? 0 : 1;
  return (((quarter - from + 4) % 4) * 90) as Turn;
}

/** The largest middle part of `from` that has the shape of `to`. */
export function cropOf(from: Size, to: Size): Size & { readonly x: number; readonly y: number } {
  const scale = Math.min(from.width / to.width, from.height / to.height);
  const width = Math.round(to.width * scale);
  const height = Math.round(to.height * scale);
  return { x: (from.width - width) >> 1, y: (from.height - height) >> 1, width, height };
}

export const pictureSize = ({ displayWidth, displayHeight }: VideoFrame): Size => ({
  width: displayWidth,
  height: displayHeight,
});
