import type { Pixel } from '../geometry/vec3';
import { FONT } from './draw_label';

export const LINE = '#ffffff';
export const ACCENT = '#c4b0ff';
export const HALO = 'rgba(0, 0, 0, 0.65)';

/** A canvas laid over a view, addressed in the view's pixels. */
export class Surface {
  readonly canvas = document.createElement('canvas');
  protected readonly context: CanvasRenderingContext2D;
  protected scale = 1; // canvas px per picture px
  private left = 0;
  private top = 0;
  protected ratio = 1;
  protected bounds = { x: 0, y: 0, width: 0, height: 0 }; // of what is drawn on [canvas px]

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
    this.bounds = { x: 0, y: 0, width, height };
    this.context.clearRect(0, 0, width, height);
    this.scale = rect.scale * this.ratio;
    this.left = rect.left * this.ratio;
    this.top = rect.top * this.ratio;
    this.context.lineCap = 'round';
    this.context.lineJoin = 'round';
  }

  /** Restricts drawing to the picture; `end` lifts it. */
  clip(width: number, height: number): void {
    const { left: x, top: y, scale } = this;
    this.bounds = { x, y, width: width * scale, height: height * scale };
    this.context.save();
    this.context.beginPath();
    this.context.rect(x, y, width * scale, height * scale);
    this.context.clip();
  }

  end(): void {
    this.context.restore();
  }

  protected x(p: Pixel): number {
    return this.left + (p.u + 0.5) * this.scale;
  }

  protected y(p: Pixel): number {
    return this.top + (p.v + 0.5) * this.scale;
  }

  /** Adds a line to the path that is begun. */
  protected line(points: readonly Pixel[]): void {
    points.forEach((p, i) => {
      if (i === 0) this.context.moveTo(this.x(p), this.y(p));
      else this.context.lineTo(this.x(p), this.y(p));
    });
  }

  protected stroke(style: string, width: number): void {
    this.context.strokeStyle = style;
    this.context.lineWidth = width * this.ratio;
    this.context.stroke();
  }

  protected trace(points: readonly Pixel[]): void {
    this.context.beginPath();
    this.line(points);
  }

  /** Signs are smaller on a small picture, where they lie closer together. */
  protected get thinning(): number {
    return Math.min(Math.max(this.scale / this.ratio, 0.6), 1.1);
  }

  /** With a halo, from the middle of the line [canvas px]. */
  protected words(text: string, x: number, y: number, colour: string): void {
    const { context, ratio } = this;
    context.font = FONT.replace('13', String(12 * ratio));
    context.textBaseline = 'middle';
    context.lineWidth = 3.5 * ratio;
    context.strokeStyle = HALO;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }
}
