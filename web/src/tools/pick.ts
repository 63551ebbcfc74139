import { pixelDistance, type Pixel, type Vec3 } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';

/** The thing whose point appears nearest to `pixel`, within `radius`. */
export function pickNearest<T>(
  view: View,
  pixel: Pixel,
  things: Iterable<T>,
  pointOf: (thing: T) => Vec3 | undefined,
  radius: number,
): T | undefined {
  let best: T | undefined;
  let bestAway = radius;
  for (const thing of things) {
    const point = pointOf(thing);
    const at = point && projectPoint(view, point);
    const away = at ? pixelDistance(at, pixel) : Infinity;
    if (away <= bestAway) {
      best = thing;
      bestAway = away;
    }
  }
  return best;
}
