import { distance } from '../geometry/vec3';
import type { Landing } from './landing';

/**
 * The length between two landings and its standard deviation [m], until the server has said what both ends
 * share. Where nothing is known of a depth, the length itself is all that can be said of its sigma.
 */
export function lengthBetween(
  from: Landing,
  to: Landing,
): { readonly lengthM: number; readonly sigmaM: number } {
  const lengthM = distance(from.pointInWorld, to.pointInWorld);
  const [a = lengthM, b = lengthM] = [from.sigmaM, to.sigmaM];
  return { lengthM, sigmaM: Math.hypot(a, b) };
}
