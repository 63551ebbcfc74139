import type { Pixel } from '../geometry/vec3';
import { trace } from '../session/trace';
import { HALO, LINE, Surface } from './surface';

/** What somebody points at or draws, as it appears. */
export interface ShownPointer {
  readonly kind: 'laser' | 'sketch';
  readonly pieces: readonly (readonly Pixel[])[];
  readonly at: Pixel;
  readonly colour: string; // CSS
  readonly name: string; // empty: one's own
}

/** The picture in its pane: its corner and scale [CSS px], its size in its own pixels. */
export interface PictureRect {
  readonly left: number;
  readonly top: number;
  readonly scale: number;
  readonly width: number;
  readonly height: number;
}

/**
 * What people point at and draw right now, on a canvas of its own: drawn the moment it is heard, without the
 * marks, the video or WebGL. Where there is nothing, there is no canvas to compose either.
 */
export class PointerLayer extends Surface {
  constructor() {
    super();
    this.canvas.className = 'marks pointers';
    this.canvas.hidden = true;
  }

  draw(
    shown: readonly ShownPointer[],
    pane: { readonly width: number; readonly height: number },
    rect: PictureRect,
  ): void {
    const { canvas } = this;
    const words = describe(shown);
    if (canvas.dataset['pointers'] !== words) {
      canvas.dataset['pointers'] = words; // for tests: whose, and where
      if (words !== '') trace('saccade.pointer.drawn', words);
    }
    if (shown.length === 0) {
      canvas.hidden = true;
      return;
    }
    canvas.hidden = false;
    this.begin(pane, rect);
    this.clip(rect.width, rect.height);
    for (const pointer of shown) this.pointer(pointer);
    this.end();
  }

  private pointer({ kind, pieces, at, colour, name }: ShownPointer): void {
    if (kind === 'laser') this.laser(at, colour);
    for (const piece of pieces) {
      this.trace(piece);
      this.stroke(HALO, 5);
      this.stroke(colour, 2);
    }
    if (name) this.words(name, this.x(at) + 12 * this.ratio, this.y(at), colour);
  }

  private laser(at: Pixel, colour: string): void {
    const disc = (radius: number, style: string): void => {
      this.context.beginPath();
      const r = radius * this.ratio * Math.max(this.thinning, 1);
      this.context.arc(this.x(at), this.y(at), r, 0, 2 * Math.PI);
      this.context.fillStyle = style;
      this.context.fill();
    };
    disc(7, HALO);
    disc(4, colour);
    disc(1.5, LINE);
  }
}

/** Of the others: name, kind, place, and of a stroke its length in pixels. */
function describe(shown: readonly ShownPointer[]): string {
  return shown
    .filter(({ name }) => name !== '')
    .map(({ kind, name, at, pieces }) => {
      const place = `${name} ${kind} ${at.u.toFixed(1)} ${at.v.toFixed(1)}`;
      return kind === 'sketch' ? `${place} ${lengthOf(pieces).toFixed(0)}` : place;
    })
    .join();
}

export function lengthOf(pieces: readonly (readonly Pixel[])[]): number {
  let length = 0;
  for (const piece of pieces) {
    piece.forEach((p, i) => {
      const last = piece[i - 1];
      if (last) length += Math.hypot(p.u - last.u, p.v - last.v);
    });
  }
  return length;
}
