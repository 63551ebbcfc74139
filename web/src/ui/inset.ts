import type { Pixel } from '../geometry/vec3';

export type Corner = 'se' | 'sw' | 'ne' | 'nw';

interface Size {
  readonly width: number;
  readonly height: number;
}

const CORNERS: readonly Corner[] = ['se', 'sw', 'ne', 'nw'];
const EDGE_PX = 14;
const ROOM_PX = 24; // round the camera: its picture is drawn there
const PATIENCE_MS = 500;

/** True if an inset in that corner of a pane lies over the point [CSS px of the pane]. */
export function covers(corner: Corner, { u, v }: Pixel, pane: Size, inset: Size): boolean {
  const left = corner.endsWith('w') ? EDGE_PX : pane.width - EDGE_PX - inset.width;
  const top = corner.startsWith('n') ? EDGE_PX : pane.height - EDGE_PX - inset.height;
  return (
    u > left - ROOM_PX &&
    u < left + inset.width + ROOM_PX &&
    v > top - ROOM_PX &&
    v < top + inset.height + ROOM_PX
  );
}

/** Where the video lies over the map: never for long over the wearer's camera, and still otherwise. */
export class InsetCorner {
  corner: Corner = 'se';
  private coveredMs: number | undefined;

  /** `camera`: where the wearer's camera appears in the pane; undefined where it does not. */
  update(nowMs: number, camera: Pixel | undefined, pane: Size, inset: Size): Corner {
    if (!camera || !covers(this.corner, camera, pane, inset)) {
      this.coveredMs = undefined;
      return this.corner;
    }
    this.coveredMs ??= nowMs;
    if (nowMs - this.coveredMs < PATIENCE_MS) return this.corner;
    const free = CORNERS.find((corner) => !covers(corner, camera, pane, inset));
    if (free) this.corner = free;
    this.coveredMs = undefined;
    return this.corner;
  }
}
