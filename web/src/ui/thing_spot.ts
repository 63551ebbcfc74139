import type { Pixel } from '../geometry/vec3';
import { eyeOf, rayOf, type View } from '../geometry/view';
import type { Landing } from '../tools/landing';
import type { Ray } from '../tools/thing_rays';
import type { Aim } from './aim';
import type { PaneName } from './app_state';

/** What is under a pointer, for things: the sight there, and where a mark would land. */
export interface Spot {
  readonly pane: PaneName;
  readonly pixel: Pixel;
  readonly view: View;
  readonly ray: Ray;
  readonly landing: Landing | undefined;
}

export function spotAt(aim: Aim, pane: PaneName, pixel: Pixel): Spot | undefined {
  const view = aim.view(pane);
  const directionInWorld = view && rayOf(view, pixel);
  if (!view || !directionInWorld) return undefined;
  const ray = { originInWorld: eyeOf(view), directionInWorld };
  return { pane, pixel, view, ray, landing: aim.landing(pane, pixel) };
}
