import { isPlaced, type Pose } from './types';

const MOST = 9000; // five minutes
const FORGOTTEN = 3000;

/** Adds where the wearer is to where he was; of another map nothing stays. */
export function follow(path: Pose[], before: Pose | undefined, pose: Pose): void {
  if (before && pose.mapRevision !== before.mapRevision) path.length = 0;
  if (!isPlaced(pose)) return;
  path.push(pose);
  if (path.length > MOST) path.splice(0, FORGOTTEN);
}
