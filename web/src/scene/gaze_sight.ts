import { projectPolyline } from '../geometry/polyline';
import type { Pixel, Vec3 } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import type { Gaze } from '../session/gaze';
import { directionOutside, type EdgeArrow, edgeTip } from './edge_arrows';
import { TARGET_CSS } from './feature_css';

/** The fixation target as it appears in a view. */
export interface Sight {
  readonly at: Pixel | undefined; // undefined: not in the picture
  readonly arrow: EdgeArrow | undefined; // towards it then
}

/** In the wearer's picture: its mark, or an arrow at the edge; beyond the joints, where to turn. */
export function sightInPicture(view: View, gaze: Gaze): Sight | undefined {
  const target = gaze.targetInWorld;
  if (!target) return undefined;
  const outside = directionOutside(view, target);
  const { guidanceRad: angle } = gaze;
  const turn = angle === undefined ? undefined : { u: Math.cos(angle), v: Math.sin(angle) };
  const direction = outside && (turn ?? outside);
  return {
    at: outside ? undefined : projectPoint(view, target),
    arrow: direction && arrowTowards(view, direction),
  };
}

function arrowTowards(view: View, direction: Pixel): EdgeArrow {
  const tip = edgeTip(view, direction);
  return { annotationId: '', colour: TARGET_CSS, hollow: false, tip, direction };
}

/** The line from the camera to the target, as seen from elsewhere. */
export const lineOfSight = (view: View, eye: Vec3, target: Vec3): Pixel[][] =>
  projectPolyline(view.camera, view.cameraFromWorld, [eye, target]);
