import { transform } from '../geometry/rigid3';
import type { Pixel } from '../geometry/vec3';
import type { View } from '../geometry/view';
import type { Mark } from './strokes';

/** A mark outside the picture: where on its edge to point, and whither (unit, picture axes). */
export interface EdgeArrow {
  readonly annotationId: string;
  readonly colour: string; // CSS
  readonly hollow: boolean;
  readonly tip: Pixel;
  readonly direction: Pixel;
}

const INSET_PX = 26;
const MAX_ARROWS = 8;

/** Arrows for marks whose anchor is not in the picture, as the server's `PointAt` has them. */
export function edgeArrowsOf(view: View, marks: readonly Mark[]): EdgeArrow[] {
  const arrows: EdgeArrow[] = [];
  for (const mark of marks) {
    const arrow = arrowTo(view, mark);
    if (arrow && arrows.push(arrow) === MAX_ARROWS) break;
  }
  return arrows;
}

function arrowTo(view: View, mark: Mark): EdgeArrow | undefined {
  const { camera } = view;
  const point = transform(view.cameraFromWorld, mark.pointInWorld);
  const pixel = point.z > 0 ? camera.project(point) : undefined;
  if (pixel && camera.inImage(pixel)) return undefined;
  const length = Math.hypot(point.x, point.y);
  // Straight behind: turn right.
  const direction = length < 1e-9 ? { u: 1, v: 0 } : { u: point.x / length, v: point.y / length };
  const middle = { u: (camera.intrinsics.width - 1) / 2, v: (camera.intrinsics.height - 1) / 2 };
  const reach = (half: number, along: number): number =>
    Math.max(half - INSET_PX, 1) / Math.max(Math.abs(along), 1e-9);
  const t = Math.min(reach(middle.u, direction.u), reach(middle.v, direction.v));
  const tip = { u: middle.u + t * direction.u, v: middle.v + t * direction.v };
  return { annotationId: mark.id, colour: mark.colour, hollow: mark.hollow, tip, direction };
}
