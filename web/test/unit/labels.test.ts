import { describe, expect, it } from 'vitest';
import { type Box, placeFor } from '../../src/ui/draw_label';
import { lengthOf } from '../../src/ui/pointer_layer';

const PANE: Box = { x: 20, y: 10, width: 400, height: 300 };
const SIZE = { width: 100, height: 21 };
const at = (x: number, y: number) => ({ x, y, ratio: 1, pane: PANE });

describe('a label', () => {
  it('stands above and to the right of its point, where there is room', () => {
    const box = placeFor(at(200, 150), SIZE, []);
    expect(box).toEqual({ x: 206, y: 125, ...SIZE });
  });

  it('stays in the picture at its edges', () => {
    for (const [x, y] of [
      [415, 150],
      [25, 12],
      [419, 309],
      [900, -50],
    ] as const) {
      const box = placeFor(at(x, y), SIZE, []);
      expect(box?.x).toBeGreaterThanOrEqual(PANE.x);
      expect(box?.y).toBeGreaterThanOrEqual(PANE.y);
      expect((box?.x ?? 0) + SIZE.width).toBeLessThanOrEqual(PANE.x + PANE.width);
      expect((box?.y ?? 0) + SIZE.height).toBeLessThanOrEqual(PANE.y + PANE.height);
    }
  });

  it('goes to another quarter rather than over another one, and away where all are taken', () => {
    const taken: Box[] = [];
    const corners = new Set<string>();
    for (let i = 0; i < 4; ++i) {
      const box = placeFor(at(200, 150), SIZE, taken);
      expect(box).toBeDefined();
      if (!box) return;
      corners.add(`${box.x < 200} ${box.y < 150}`);
      taken.push(box);
    }
    expect(corners.size).toBe(4);
    expect(placeFor(at(200, 150), SIZE, taken)).toBeUndefined();
  });
});

describe('the length of a sketch', () => {
  it('is that of its pieces, not of the gaps between them', () => {
    const piece = (u: number) => [
      { u, v: 0 },
      { u: u + 3, v: 4 },
    ];
    expect(lengthOf([piece(0), piece(100)])).toBeCloseTo(10);
    expect(lengthOf([])).toBe(0);
  });
});
