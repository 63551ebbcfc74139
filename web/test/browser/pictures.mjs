import pngjs from 'pngjs';

/** {width, height, data (RGBA)} of a PNG. */
export const decodePng = (bytes) => pngjs.PNG.sync.read(Buffer.from(bytes));

/** Peak signal to noise ratio of the colours of two pictures of one size [dB]. */
export function psnr(a, b) {
  if (a.width !== b.width || a.height !== b.height) {
    throw new Error(`sizes differ: ${a.width}x${a.height} and ${b.width}x${b.height}`);
  }
  let sum = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    for (let c = 0; c < 3; ++c) sum += (a.data[i + c] - b.data[i + c]) ** 2;
  }
  const mean = sum / (3 * a.width * a.height);
  return mean === 0 ? Infinity : 10 * Math.log10(255 ** 2 / mean);
}

/** Coordinates of the pixels within `tolerance` of a colour and opaque. */
export function pixelsOf({ width, data }, [r, g, b], tolerance) {
  const out = [];
  for (let i = 0; i < data.length; i += 4) {
    const far = Math.max(
      Math.abs(data[i] - r),
      Math.abs(data[i + 1] - g),
      Math.abs(data[i + 2] - b),
    );
    if (far <= tolerance && data[i + 3] > 200) {
      out.push([(i / 4) % width, Math.floor(i / 4 / width)]);
    }
  }
  return out;
}

export const mean = (points) =>
  points.reduce((sum, p) => [sum[0] + p[0] / points.length, sum[1] + p[1] / points.length], [0, 0]);

export const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
