import { describe, expect, it } from 'vitest';
import { isBlack } from '../../src/ui/darkness';

const picture = (level: number, spot = level): Uint8ClampedArray => {
  const rgba = new Uint8ClampedArray(16 * 12 * 4);
  for (let i = 0; i < rgba.length; i += 4) rgba.set([level, level, level, 255], i);
  rgba.set([spot, spot, spot, 255], 100 * 4);
  return rgba;
};

describe('a black picture', () => {
  it('is one without light, noise or not', () => {
    expect(isBlack(picture(0))).toBe(true);
    expect(isBlack(picture(3, 7))).toBe(true);
  });

  it('is none where anything is to be seen: a lamp in a dark room, a dim room', () => {
    expect(isBlack(picture(2, 90))).toBe(false);
    expect(isBlack(picture(14))).toBe(false);
  });
});
