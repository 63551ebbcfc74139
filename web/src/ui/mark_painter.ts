import type { Pixel } from '../geometry/vec3';
import type { EdgeArrow } from '../scene/edge_arrows';
import type { Label, Marks, Stroke } from '../scene/strokes';
import { type Box, drawLabel } from './draw_label';
import { paintGrid } from './picture_grid';
import { ACCENT, HALO, Surface } from './surface';

/** A picture where it appears: rows of points from its upper left corner. */
export interface ShownPicture {
  readonly grid: readonly (readonly (Pixel | undefined)[])[];
  readonly image: ImageBitmap;
}

/** Marks, and what people do with them. */
export class MarkPainter extends Surface {
  /**
   * Lines with a dark halo, a hollow one dashed; accented ones in that colour and above the rest. Lines of
   * one look are one path: with hundreds of marks the calls would take the time, not the lines.
   */
  marks({ strokes, labels }: Marks, accented: readonly (string | undefined)[]): void {
    const chosen = (id: string): boolean => id !== '' && accented.includes(id);
    const groups = new Map<string, { colour: string; hollow: boolean; lines: Stroke[] }>();
    const above: typeof groups = new Map();
    this.context.beginPath();
    for (const stroke of strokes) {
      this.line(stroke.points);
      const top = chosen(stroke.annotationId);
      const { hollow } = stroke;
      const colour = top ? ACCENT : stroke.colour;
      const into = top ? above : groups;
      const group = into.get(`${colour}${hollow}`);
      if (group) group.lines.push(stroke);
      else into.set(`${colour}${hollow}`, { colour, hollow, lines: [stroke] });
    }
    this.stroke(HALO, 5);
    for (const { colour, hollow, lines } of [...groups.values(), ...above.values()]) {
      if (hollow) this.context.setLineDash([5 * this.ratio, 5 * this.ratio]);
      this.context.beginPath();
      for (const { points } of lines) this.line(points);
      this.stroke(colour, 2);
      this.context.setLineDash([]);
    }
    const topmost = labels.filter(({ annotationId }) => chosen(annotationId));
    const taken: Box[] = [];
    const others = labels.filter(({ annotationId }) => !chosen(annotationId));
    for (const label of others.reverse()) this.label(label, label.colour, false, taken); // newest first
    // The chosen one says all it has to say, where there is room for it.
    for (const label of topmost) this.label(label, ACCENT, true);
  }

  private label(label: Label, colour: string, whole: boolean, taken?: Box[]): void {
    const { at, hollow } = label;
    const { ratio, bounds } = this;
    const place = { x: this.x(at), y: this.y(at), ratio, pane: bounds, whole };
    drawLabel(this.context, label, place, { colour, hollow }, taken);
  }

  pictures(pictures: readonly ShownPicture[]): void {
    for (const { grid, image } of pictures) {
      const places = grid.map((row) => row.map((p) => p && { x: this.x(p), y: this.y(p) }));
      paintGrid(this.context, image, places);
    }
  }

  /** Towards marks outside the picture: filled, or an outline where not to be trusted. */
  edgeArrows(arrows: readonly EdgeArrow[], accented: readonly (string | undefined)[]): void {
    const size = this.ratio * this.thinning;
    for (const { tip, direction, hollow, annotationId, colour } of arrows) {
      const [x, y] = [this.x(tip), this.y(tip)];
      const [du, dv] = [direction.u * size, direction.v * size];
      this.context.beginPath();
      this.context.moveTo(x, y);
      this.context.lineTo(x - 18 * du - 10 * dv, y - 18 * dv + 10 * du);
      this.context.lineTo(x - 18 * du + 10 * dv, y - 18 * dv - 10 * du);
      this.context.closePath();
      this.stroke(HALO, 6);
      const chosen = annotationId !== '' && accented.includes(annotationId);
      this.context.fillStyle = chosen ? ACCENT : colour;
      if (!hollow) this.context.fill();
      this.stroke(chosen ? ACCENT : colour, 2);
    }
  }

  /** What turns the selected mark: a ring with an arc round it. */
  handle(at: Pixel): void {
    const { context, ratio } = this;
    const [x, y] = [this.x(at), this.y(at)];
    const ring = (): void => {
      context.beginPath();
      context.arc(x, y, 5 * ratio, 0, 2 * Math.PI);
      context.moveTo(x + 11 * ratio * Math.cos(-2.4), y + 11 * ratio * Math.sin(-2.4));
      context.arc(x, y, 11 * ratio, -2.4, -0.7);
    };
    ring();
    this.stroke(HALO, 5);
    ring();
    this.stroke(ACCENT, 2);
  }

  /** A rectangle being drawn round marks. */
  area(a: Pixel, b: Pixel): void {
    const { context, ratio } = this;
    const [x, y] = [this.x(a), this.y(a)];
    context.beginPath();
    context.rect(x, y, this.x(b) - x, this.y(b) - y);
    context.fillStyle = 'rgba(196, 176, 255, 0.14)';
    context.fill();
    this.stroke(HALO, 4);
    context.setLineDash([6 * ratio, 4 * ratio]);
    this.stroke(ACCENT, 1.6);
    context.setLineDash([]);
  }
}
