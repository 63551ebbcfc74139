import { readsRightToLeft, wrap } from '../scene/wrap';

export const FONT = '600 13px system-ui, sans-serif';

const MAX_LINE_PX = 300;
const STEP_PX = 17;
const INSET_PX = 6;
const MOST_OF_PANE = 0.45;

/** Where a label belongs [canvas px]; with `pane` all of it, wrapped and within that. */
export interface LabelPlace {
  readonly x: number;
  readonly y: number;
  readonly ratio: number; // canvas px per CSS px
  readonly pane: { readonly width: number; readonly height: number } | undefined;
}

/** On the canvas [px]. */
export interface Box {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

const overlap = (a: Box, b: Box): boolean =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

/**
 * A filled box with text, its lower left corner beside a point. Where it would lie over one of `taken`
 * it is left out, and otherwise joins them: of a crowd of marks some can be read, and each when chosen.
 */
export function drawLabel(
  context: CanvasRenderingContext2D,
  { text, whole }: { readonly text: string; readonly whole: string },
  { x: atX, y: atY, ratio, pane }: LabelPlace,
  { colour, hollow }: { readonly colour: string; readonly hollow: boolean },
  taken?: Box[],
): void {
  context.font = FONT.replace('13', String(13 * ratio));
  const widthOf = (line: string): number => context.measureText(line).width;
  const inset = INSET_PX * ratio;
  const step = STEP_PX * ratio;
  const most = pane && Math.min(MAX_LINE_PX * ratio, pane.width - 4 * inset);
  let lines = most === undefined ? [text] : wrap(whole, (line) => widthOf(line) <= most);
  // Not where it would hide what it is about; the large pane and the list have the room.
  if (pane && lines.length * step > MOST_OF_PANE * pane.height) lines = [text];
  const width = Math.max(...lines.map(widthOf)) + 2 * inset;
  const height = step * lines.length + 4 * ratio;
  let x = atX + inset;
  let y = atY - height - 4 * ratio;
  if (pane) {
    x = Math.max(0, Math.min(x, pane.width - width));
    y = Math.max(0, Math.min(y, pane.height - height));
  }
  const box = { x, y, width, height };
  if (taken?.some((other) => overlap(box, other))) return;
  taken?.push(box);
  context.fillStyle = 'rgba(16, 17, 18, 0.86)';
  context.strokeStyle = colour;
  context.lineWidth = 1.5 * ratio;
  if (hollow) context.setLineDash([4 * ratio, 4 * ratio]);
  context.beginPath();
  context.roundRect(x, y, width, height, 4 * ratio);
  context.fill();
  context.stroke();
  context.setLineDash([]);
  context.fillStyle = colour;
  context.textBaseline = 'middle';
  lines.forEach((line, i) => {
    const rightToLeft = readsRightToLeft(line);
    context.direction = rightToLeft ? 'rtl' : 'ltr';
    context.textAlign = rightToLeft ? 'right' : 'left';
    const from = rightToLeft ? x + width - inset : x + inset;
    context.fillText(line, from, y + step * (i + 0.5) + 2.5 * ratio);
  });
  context.direction = 'ltr';
  context.textAlign = 'left';
}
