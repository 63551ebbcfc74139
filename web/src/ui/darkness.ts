const WIDTH = 16;
const HEIGHT = 12;
const BLACK = 8; // of 255: noise of a covered lens stays below
const EVERY_MS = 500;

/** True if RGBA pixels show nothing: no light came through the lens. */
export function isBlack(rgba: ArrayLike<number>): boolean {
  let brightest = 0;
  for (let i = 0; i + 3 < rgba.length; i += 4) {
    brightest = Math.max(brightest, rgba[i] ?? 0, rgba[i + 1] ?? 0, rgba[i + 2] ?? 0);
  }
  return brightest < BLACK;
}

/** Looks twice a second whether a picture is black. */
export class Darkness {
  black = false;
  private readonly context: CanvasRenderingContext2D | null;
  private lookedMs = -Infinity;

  constructor() {
    const canvas = document.createElement('canvas');
    canvas.width = WIDTH;
    canvas.height = HEIGHT;
    this.context = canvas.getContext('2d', { willReadFrequently: true });
  }

  look(picture: HTMLCanvasElement, nowMs: number): void {
    if (!this.context || nowMs - this.lookedMs < EVERY_MS) return;
    this.lookedMs = nowMs;
    this.context.drawImage(picture, 0, 0, WIDTH, HEIGHT);
    this.black = isBlack(this.context.getImageData(0, 0, WIDTH, HEIGHT).data);
  }
}
