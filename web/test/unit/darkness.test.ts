import { describe, expect, it } from 'vitest';
import { type Channel, isBlack } from '../../src/ui/darkness';

const WIDTH = 64;
const HEIGHT = 48;

/** A picture of one level with a block of another, as rows of `stride` bytes after `offset`. */
function picture(level: number, spot = level, { step = 1, offset = 0 } = {}): Channel {
  const stride = WIDTH * step + 16;
  const bytes = new Uint8Array(offset + stride * HEIGHT).fill(255); // beside the picture: bright
  for (let y = 0; y < HEIGHT; ++y) {
    for (let x = 0; x < WIDTH; ++x) {
      const inSpot = x >= 40 && x < 44 && y >= 20 && y < 24;
      bytes[offset + y * stride + x * step] = inSpot ? spot : level;
    }
  }
  return { bytes, offset, stride, step, width: WIDTH, height: HEIGHT };
}

describe('a black picture', () => {
  it('is one without light, noise or not', () => {
    expect(isBlack(picture(0), true)).toBe(true);
    expect(isBlack(picture(3, 7), true)).toBe(true);
    const noisy = picture(2);
    noisy.bytes[5 * noisy.stride + 7] = 60; // one hot pixel
    expect(isBlack(noisy, true)).toBe(true);
  });

  it('is none where anything is to be seen: a lamp in a dark room, a dim room', () => {
    expect(isBlack(picture(2, 90), true)).toBe(false);
    expect(isBlack(picture(14), true)).toBe(false);
  });

  it('is judged by the levels that video has, and by one channel of packed colours', () => {
    expect(isBlack(picture(17), false)).toBe(true);
    expect(isBlack(picture(30), false)).toBe(false);
    expect(isBlack(picture(1, 1, { step: 4, offset: 1 }), true)).toBe(true);
    expect(isBlack(picture(1, 99, { step: 4, offset: 1 }), true)).toBe(false);
  });
});
