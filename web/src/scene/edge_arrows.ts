import { transform } from '../geometry/rigid3';
import type { Pixel, Vec3 } from '../geometry/vec3';
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
  const direction = directionOutside(view, mark.pointInWorld);
  if (!direction) return undefined;
  const tip = edgeTip(view, direction);
  return { annotationId: mark.id, colour: mark.colour, hollow: mark.hollow, tip, direction };
}

/** Whither a point lies that is not in the picture (unit, picture axes); undefined if it is. */
export function directionOutside(view: View, pointInWorld: Vec3): Pixel | undefined {
  const { camera } = view;
  const point = transform(view.cameraFromWorld, pointInWorld);
  const pixel = point.z > 0 ? camera.project(point) : undefined;
  if (pixel && camera.inImage(pixel)) return undefined;
  const length = Math.hypot(point.x, point.y);
  // Straight behind: turn right.
  return length < 1e-9 ? { u: 1, v: 0 } : { u: point.x / length, v: point.y / length };
}

/** Where an arrow from the picture's middle in that direction meets its edge. */
export function edgeTip({ camera }: View, direction: Pixel): Pixel {
  const middle = { u: (camera.intrinsics.width - 1) / 2, v: (camera.intrinsics.height - 1) / 2 };
  const reach = (half: number, along: number): number =>
    Math.max(half - INSET_PX, 1) / Math.max(Math.abs(along), 1e-9);
  const t = Math.min(reach(middle.u, direction.u), reach(middle.v, direction.v));
  return { u: middle.u + t * direction.u, v: middle.v + t * direction.v };
}
