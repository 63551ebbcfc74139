import type { Quaternion } from '../geometry/rigid3';
import { add, norm, type Pixel, scale, type Vec3 } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { handleDirection } from './turn';

/** What of a mark its handle depends on. */
export interface Turnable {
  readonly shape: string;
  readonly sizeM: number;
  readonly extentM: Vec3 | undefined;
  readonly worldFromMark: Quaternion | undefined;
  readonly pointInWorld: Vec3;
}

/** From the anchor to the handle [m]: an arrow's is at its tail, a box's above it. */
export const handleLength = ({ shape, sizeM, extentM }: Turnable): number =>
  shape === 'box' && extentM ? extentM.y / 2 + 0.25 * norm(extentM) : 2 * sizeM;

/** Where the handle that turns a mark appears. */
export function handleOf(view: View, mark: Turnable | undefined): Pixel | undefined {
  if (!mark) return undefined;
  const arm = scale(handleDirection(mark.worldFromMark), handleLength(mark));
  return projectPoint(view, add(mark.pointInWorld, arm));
}
