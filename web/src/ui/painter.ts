import type { Pixel } from '../geometry/vec3';
import { FEATURE_CSS, TARGET_CSS } from '../scene/feature_css';
import type { EdgeArrow } from '../scene/edge_arrows';
import type { AxisStroke, Label, Marks } from '../scene/strokes';
import type { FeatureState } from '../session/types';
import { type Box, drawLabel, FONT } from './draw_label';

const LINE = '#ffffff';
const ACCENT = '#c4b0ff';
const HALO = 'rgba(0, 0, 0, 0.65)';
const AXIS = '#c9ccd0';
const MAX_RING_PX = 120;

/** Draws pixels of a view onto a canvas laid over it. */
export class Painter {
  readonly canvas = document.createElement('canvas');
  private readonly context: CanvasRenderingContext2D;
  private scale = 1; // canvas px per picture px
  private left = 0;
  private top = 0;
  private ratio = 1;
  private right = 0; // edge of what is drawn on [canvas px]

  /** `ratio`: canvas pixels per CSS pixel; by default the screen's. */
  constructor(private readonly fixedRatio?: number) {
    this.canvas.className = 'marks';
    const context = this.canvas.getContext('2d');
    if (!context) throw new Error('this browser has no 2D canvas');
    this.context = context;
  }

  /** Clears, and maps picture pixels so that the picture fills `rect` (CSS px in the pane). */
  begin(
    pane: { width: number; height: number },
    rect: { left: number; top: number; scale: number },
  ): void {
    this.ratio = this.fixedRatio ?? Math.min(window.devicePixelRatio, 2);
    const width = Math.round(pane.width * this.ratio);
    const height = Math.round(pane.height * this.ratio);
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    this.right = width;
    this.context.clearRect(0, 0, width, height);
    this.scale = rect.scale * this.ratio;
    this.left = rect.left * this.ratio;
    this.top = rect.top * this.ratio;
    this.context.lineCap = 'round';
    this.context.lineJoin = 'round';
  }

  /** Restricts drawing to the picture; `end` lifts it. */
  clip(width: number, height: number): void {
    this.right = this.left + width * this.scale;
    this.context.save();
    this.context.beginPath();
    this.context.rect(this.left, this.top, width * this.scale, height * this.scale);
    this.context.clip();
  }

  end(): void {
    this.context.restore();
  }

  private x(p: Pixel): number {
    return this.left + (p.u + 0.5) * this.scale;
  }

  private y(p: Pixel): number {
    return this.top + (p.v + 0.5) * this.scale;
  }

  private trace(points: readonly Pixel[]): void {
    this.context.beginPath();
    points.forEach((p, i) => {
      if (i === 0) this.context.moveTo(this.x(p), this.y(p));
      else this.context.lineTo(this.x(p), this.y(p));
    });
  }

  private stroke(style: string, width: number): void {
    this.context.strokeStyle = style;
    this.context.lineWidth = width * this.ratio;
    this.context.stroke();
  }

  /** Lines with a dark halo, a hollow one dashed; accented ones in that colour and above the rest. */
  marks({ strokes, labels }: Marks, accented: readonly (string | undefined)[]): void {
    const chosen = (id: string): boolean => id !== '' && accented.includes(id);
    for (const { points } of strokes) {
      this.trace(points);
      this.stroke(HALO, 5);
    }
    const below = strokes.filter(({ annotationId }) => !chosen(annotationId));
    const above = strokes.filter(({ annotationId }) => chosen(annotationId));
    for (const { points, hollow, annotationId, colour } of [...below, ...above]) {
      if (hollow) this.context.setLineDash([5 * this.ratio, 5 * this.ratio]);
      this.trace(points);
      this.stroke(chosen(annotationId) ? ACCENT : colour, 2);
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
    const pane = whole ? { width: this.right, height: this.canvas.height } : undefined;
    const place = { x: this.x(at), y: this.y(at), ratio: this.ratio, pane };
    drawLabel(this.context, label, place, { colour, hollow }, taken);
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

  /** Signs are smaller on a small picture, where they lie closer together. */
  private get thinning(): number {
    return Math.min(Math.max(this.scale / this.ratio, 0.6), 1.1);
  }

  /** Colour and shape by state: disc measured, cross failed, ring not attempted. */
  feature(at: Pixel, state: FeatureState): void {
    const { context, ratio } = this;
    const x = this.x(at);
    const y = this.y(at);
    const r = 3.5 * ratio * this.thinning;
    context.beginPath();
    if (state === 'failed') {
      context.moveTo(x - r, y - r);
      context.lineTo(x + r, y + r);
      context.moveTo(x + r, y - r);
      context.lineTo(x - r, y + r);
    } else {
      context.arc(x, y, r, 0, 2 * Math.PI);
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
    const left = right + context.measureText(words).width > this.right;
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

  /** With a halo, from the middle of the line [canvas px]. */
  private words(text: string, x: number, y: number, colour: string): void {
    const { context, ratio } = this;
    context.font = FONT.replace('13', String(12 * ratio));
    context.textBaseline = 'middle';
    context.lineWidth = 3.5 * ratio;
    context.strokeStyle = HALO;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
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
  ring(at: Pixel, radius: number | undefined, words: string): void {
    const { context, ratio } = this;
    const size = (radius ?? 0) * this.scale;
    const r = Math.min(Math.max(size, 5 * ratio), MAX_RING_PX * ratio);
    context.beginPath();
    context.arc(this.x(at), this.y(at), r, 0, 2 * Math.PI);
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
