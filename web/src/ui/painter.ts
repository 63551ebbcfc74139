import type { Pixel } from '../geometry/vec3';
import { FEATURE_CSS, TARGET_CSS } from '../scene/feature_css';
import type { EdgeArrow } from '../scene/edge_arrows';
import type { AxisStroke } from '../scene/strokes';
import type { FeatureState } from '../session/types';
import { FONT } from './draw_label';
import { MarkPainter } from './mark_painter';
import { ACCENT, HALO, LINE } from './surface';

const AXIS = '#c9ccd0';
const MAX_RING_PX = 120;

/** Draws pixels of a view onto a canvas laid over it: marks, and what the tracker and the head are at. */
export class Painter extends MarkPainter {
  /** Colour and shape by state: disc measured, cross failed, ring not attempted; all of one state at once. */
  features(state: FeatureState, places: readonly Pixel[]): void {
    const { context, ratio } = this;
    const r = 3.5 * ratio * this.thinning;
    context.beginPath();
    for (const at of places) {
      const x = this.x(at);
      const y = this.y(at);
      if (state === 'failed') {
        context.moveTo(x - r, y - r);
        context.lineTo(x + r, y + r);
        context.moveTo(x + r, y - r);
        context.lineTo(x - r, y + r);
      } else {
        context.moveTo(x + r, y);
        context.arc(x, y, r, 0, 2 * Math.PI);
      }
    }
    this.stroke(HALO, 4);
    context.fillStyle = FEATURE_CSS[state];
    if (state === 'measured') context.fill();
    else this.stroke(FEATURE_CSS[state], 1.8);
  }

  /** The fixation target: a ring with four ticks, solid once it is held, and few words beside it. */
  target(at: Pixel, held: boolean, words: string): void {
    const { context, ratio } = this;
    const [x, y] = [this.x(at), this.y(at)];
    const r = 13 * ratio * this.thinning;
    const ring = (): void => {
      context.beginPath();
      context.arc(x, y, r, 0, 2 * Math.PI);
    };
    const ticks = (): void => {
      context.beginPath();
      for (const [dx, dy] of [
        [1, 0],
        [0, 1],
        [-1, 0],
        [0, -1],
      ] as const) {
        context.moveTo(x + dx * r * 0.55, y + dy * r * 0.55);
        context.lineTo(x + dx * r * 1.55, y + dy * r * 1.55);
      }
    };
    for (const draw of [ring, ticks]) {
      draw();
      this.stroke(HALO, 5.5);
    }
    if (!held) context.setLineDash([4 * ratio, 4 * ratio]);
    ring();
    this.stroke(TARGET_CSS, 2.5);
    context.setLineDash([]);
    ticks();
    this.stroke(TARGET_CSS, 2.5);
    const right = x + r * 1.7;
    context.font = FONT.replace('13', String(12 * ratio));
    // Near the edge: on the other side.
    const left = right + context.measureText(words).width > this.bounds.x + this.bounds.width;
    if (left) context.textAlign = 'right';
    this.words(words, left ? x - r * 1.7 : right, y + r * 1.3, TARGET_CSS);
    context.textAlign = 'left';
  }

  /** From the camera to what it is to look at. */
  lineOfSight(pieces: readonly (readonly Pixel[])[]): void {
    this.context.setLineDash([7 * this.ratio, 6 * this.ratio]);
    for (const piece of pieces) {
      this.trace(piece);
      this.stroke(HALO, 4.5);
      this.stroke(TARGET_CSS, 2);
    }
    this.context.setLineDash([]);
  }

  /** The optic axis: what is held appears here. */
  centre(at: Pixel): void {
    const arm = 5 * this.ratio;
    const [x, y] = [this.x(at), this.y(at)];
    const cross = (): void => {
      this.context.beginPath();
      this.context.moveTo(x - arm, y);
      this.context.lineTo(x + arm, y);
      this.context.moveTo(x, y - arm);
      this.context.lineTo(x, y + arm);
    };
    cross();
    this.stroke(HALO, 4);
    cross();
    this.stroke(LINE, 1.5);
  }

  /** Words inside the edge that an arrow points to. */
  arrowWords(words: string, { tip, direction }: EdgeArrow): void {
    const { context, ratio } = this;
    const away = 30 * ratio;
    context.textAlign = direction.u > 0.4 ? 'right' : direction.u < -0.4 ? 'left' : 'center';
    this.words(
      words,
      this.x(tip) - direction.u * away,
      this.y(tip) - direction.v * away,
      TARGET_CSS,
    );
    context.textAlign = 'left';
  }

  axes(axes: readonly AxisStroke[]): void {
    for (const { pieces } of axes) {
      for (const piece of pieces) {
        this.trace(piece);
        this.stroke(HALO, 4);
        this.stroke(AXIS, 1.5);
      }
    }
    for (const { name, end } of axes) {
      if (end) this.words(name, this.x(end) + 5 * this.ratio, this.y(end), AXIS);
    }
  }

  /** Where a click lands: a ring as large as its uncertainty [picture px], and how large in words. */
  ring(
    at: Pixel,
    radius: number | undefined,
    words: string,
    lying?: (times: number) => readonly (readonly Pixel[])[],
  ): void {
    const { context, ratio } = this;
    const size = (radius ?? 0) * this.scale;
    const r = Math.min(Math.max(size, 5 * ratio), MAX_RING_PX * ratio);
    context.beginPath();
    if (lying && size > 0) for (const piece of lying(r / size)) this.line(piece);
    else context.arc(this.x(at), this.y(at), r, 0, 2 * Math.PI);
    // Dashed: not to scale, the words say how large.
    if (radius === undefined || size > r) context.setLineDash([3 * ratio, 4 * ratio]);
    this.stroke(HALO, 4);
    this.stroke(ACCENT, 1.6);
    context.setLineDash([]);
    context.beginPath();
    context.arc(this.x(at), this.y(at), 1.6 * ratio, 0, 2 * Math.PI);
    context.fillStyle = ACCENT;
    context.fill();
    this.words(words, this.x(at) + r + 7 * ratio, this.y(at), LINE);
  }
}
