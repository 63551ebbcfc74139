import pngjs from 'pngjs';

/** {width, height, data (RGBA)} of a PNG. */
export const decodePng = (bytes) => pngjs.PNG.sync.read(Buffer.from(bytes));

const DEPTH_PER_METRE = 5000; // as the TUM RGB-D data sets

/** `at([u, v])`: depth along the optic axis [m] at the nearest pixel, 0 where nothing is or beyond the picture. */
export function decodeDepthPng(bytes) {
  const { width, height, data } = pngjs.PNG.sync.read(Buffer.from(bytes), { skipRescale: true });
  return {
    at: ([u, v]) => {
      const [column, row] = [Math.round(u), Math.round(v)];
      if (column < 0 || row < 0 || column >= width || row >= height) return 0;
      return data[4 * (row * width + column)] / DEPTH_PER_METRE;
    },
  };
}

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

/** The same picture in grey (Rec. 601), in all three colours. */
export function greyOf({ width, height, data }) {
  const grey = new Float32Array(data.length);
  for (let i = 0; i < data.length; i += 4) {
    grey.fill(0.299 * data[i] + 0.587 * data[i + 1] + 0.114 * data[i + 2], i, i + 3);
  }
  return { width, height, data: grey };
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

/** Connected pixels (also at corners): {size, width, height, middle} of each. */
export function blobsOf(pixels) {
  const key = (x, y) => 65536 * y + x;
  const left = new Map(pixels.map(([x, y]) => [key(x, y), [x, y]]));
  const blobs = [];
  for (const first of pixels) {
    if (!left.delete(key(...first))) continue;
    const found = [first];
    for (let i = 0; i < found.length; ++i) {
      const [x, y] = found[i];
      for (let k = 0; k < 9; ++k) {
        const at = [x + (k % 3) - 1, y + Math.floor(k / 3) - 1];
        if (left.delete(key(...at))) found.push(at);
      }
    }
    const extent = (axis) => {
      const values = found.map((point) => point[axis]);
      return [Math.min(...values), Math.max(...values)];
    };
    const [[x0, x1], [y0, y1]] = [extent(0), extent(1)];
    const middle = [(x0 + x1) / 2, (y0 + y1) / 2];
    blobs.push({ size: found.length, width: x1 - x0 + 1, height: y1 - y0 + 1, middle });
  }
  return blobs;
}
