import type { Calibration, CalibrationFit, CalibrationPicture } from '../session/calibration';

const ARROW_SHARE = 0.05; // of the picture's width: how long the median arrow is drawn

const inkOf = (name: string): string =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Makes `canvas` as fine as the screen is; its context, in CSS pixels. */
function fit(canvas: HTMLCanvasElement, aspect: number): CanvasRenderingContext2D | undefined {
  const width = canvas.clientWidth;
  const height = Math.round(width / aspect);
  const fine = Math.min(2, window.devicePixelRatio || 1);
  if (canvas.width !== Math.round(width * fine) || canvas.height !== Math.round(height * fine)) {
    canvas.width = Math.round(width * fine);
    canvas.height = Math.round(height * fine);
    canvas.style.height = `${height}px`;
  }
  const context = canvas.getContext('2d') ?? undefined;
  context?.setTransform(fine, 0, 0, fine, 0, 0);
  return context;
}

/** The picture, the corners found in it, and a veil over the parts where none was yet. */
export function drawCoverage(
  canvas: HTMLCanvasElement,
  bitmap: ImageBitmap | undefined,
  picture: CalibrationPicture | undefined,
  now: Calibration | undefined,
): void {
  const aspect = picture === undefined ? 4 / 3 : picture.widthPx / picture.heightPx;
  const context = fit(canvas, aspect);
  if (context === undefined) return;
  const width = canvas.clientWidth;
  const height = width / aspect;
  context.fillStyle = '#131415'; // the picture's ground stays dark, as everywhere
  context.fillRect(0, 0, width, height);
  if (bitmap !== undefined) context.drawImage(bitmap, 0, 0, width, height);
  if (now !== undefined && now.columns > 0) drawParts(context, now, width, height);
  if (picture !== undefined) drawCorners(context, picture, width / picture.widthPx);
}

function drawParts(
  context: CanvasRenderingContext2D,
  { columns, rows, counts }: Calibration,
  width: number,
  height: number,
): void {
  const [w, h] = [width / columns, height / rows];
  for (let row = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      const seen = (counts[row * columns + column] ?? 0) > 0;
      if (!seen) {
        context.fillStyle = 'rgb(19 20 21 / 0.62)';
        context.fillRect(column * w, row * h, w, h);
      }
      context.setLineDash(seen ? [] : [3, 4]);
      context.strokeStyle = seen ? 'rgb(233 234 235 / 0.55)' : 'rgb(233 234 235 / 0.35)';
      context.strokeRect(column * w + 0.5, row * h + 0.5, w - 1, h - 1);
    }
  }
  context.setLineDash([]);
}

function drawCorners(
  context: CanvasRenderingContext2D,
  { cornersPx, taken }: CalibrationPicture,
  scale: number,
): void {
  const radius = taken ? 4 : 2.5;
  for (const [ink, line] of [['#131415', 4] as const, ['#c4b0ff', 1.8] as const]) {
    context.strokeStyle = ink;
    context.lineWidth = line;
    for (let k = 0; k + 1 < cornersPx.length; k += 2) {
      context.beginPath();
      context.arc(
        ((cornersPx[k] ?? 0) + 0.5) * scale,
        ((cornersPx[k + 1] ?? 0) + 0.5) * scale,
        radius,
        0,
        2 * Math.PI,
      );
      context.stroke();
    }
  }
  context.lineWidth = 1;
}

/** How many times too long arrows are drawn, so that the median one can be seen: 1, 2 or 5 times a power of 10. */
export function arrowScale(residualsPx: readonly number[], widthPx: number): number {
  const lengths: number[] = [];
  for (let k = 0; k + 3 < residualsPx.length; k += 4) {
    lengths.push(Math.hypot(residualsPx[k + 2] ?? 0, residualsPx[k + 3] ?? 0));
  }
  lengths.sort((a, b) => a - b);
  const median = lengths[Math.floor(lengths.length / 2)] ?? 0;
  if (median <= 0) return 1;
  const wanted = (ARROW_SHARE * widthPx) / median;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const step = [5, 2, 1].find((each) => each * power <= wanted) ?? 1;
  return Math.max(1, step * power);
}

/** From each corner to where the lens found has it, drawn `scale` times as long. */
export function drawResiduals(
  canvas: HTMLCanvasElement,
  { residualsPx }: CalibrationFit,
  size: { readonly width: number; readonly height: number },
  scale: number,
): void {
  const context = fit(canvas, size.width / size.height);
  if (context === undefined) return;
  const small = canvas.clientWidth / size.width;
  context.fillStyle = inkOf('--ground');
  context.fillRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  context.strokeStyle = inkOf('--line');
  context.strokeRect(0.5, 0.5, size.width * small - 1, size.height * small - 1);
  context.strokeStyle = inkOf('--accent');
  context.globalAlpha = 0.75;
  context.beginPath();
  for (let k = 0; k + 3 < residualsPx.length; k += 4) {
    const [x, y] = [(residualsPx[k] ?? 0) * small, (residualsPx[k + 1] ?? 0) * small];
    context.moveTo(x, y);
    context.lineTo(
      x + (residualsPx[k + 2] ?? 0) * small * scale,
      y + (residualsPx[k + 3] ?? 0) * small * scale,
    );
  }
  context.stroke();
  context.globalAlpha = 1;
}
