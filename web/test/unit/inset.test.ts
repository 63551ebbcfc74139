import { describe, expect, it } from 'vitest';
import { covers, InsetCorner } from '../../src/ui/inset';

const pane = { width: 1000, height: 700 };
const inset = { width: 340, height: 255 };

describe('the video over the map', () => {
  it('stays where it is while the camera is elsewhere', () => {
    const place = new InsetCorner();
    for (let ms = 0; ms < 5000; ms += 16) {
      expect(place.update(ms, { u: 300, v: 200 }, pane, inset)).toBe('se');
    }
    expect(place.update(6000, undefined, pane, inset)).toBe('se');
  });

  it('goes to a free corner once it has lain over the camera for half a second, and stays', () => {
    const place = new InsetCorner();
    const camera = { u: 800, v: 600 };
    expect(covers('se', camera, pane, inset)).toBe(true);
    expect(place.update(0, camera, pane, inset)).toBe('se');
    expect(place.update(400, camera, pane, inset)).toBe('se');
    expect(place.update(600, camera, pane, inset)).toBe('sw');
    expect(place.update(5000, { u: 500, v: 300 }, pane, inset)).toBe('sw');
  });

  it('does not jump for a camera that only passes by', () => {
    const place = new InsetCorner();
    place.update(0, { u: 800, v: 600 }, pane, inset);
    place.update(400, { u: 300, v: 200 }, pane, inset);
    expect(place.update(600, { u: 800, v: 600 }, pane, inset)).toBe('se');
  });

  it('never covers the camera where a corner is free of it, wherever that is', () => {
    for (let u = 0; u <= pane.width; u += 25) {
      for (let v = 0; v <= pane.height; v += 25) {
        const place = new InsetCorner();
        place.update(0, { u, v }, pane, inset);
        const corner = place.update(1000, { u, v }, pane, inset);
        expect(covers(corner, { u, v }, pane, inset)).toBe(false);
      }
    }
  });

  it('stays in a window so small that every corner covers it', () => {
    const small = { width: 300, height: 200 };
    const place = new InsetCorner();
    place.update(0, { u: 150, v: 100 }, small, { width: 200, height: 150 });
    expect(place.update(1000, { u: 150, v: 100 }, small, { width: 200, height: 150 })).toBe('se');
  });
});
