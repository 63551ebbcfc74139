import { readsRightToLeft, wrap } from '../scene/wrap';

export const FONT = '600 13px system-ui, sans-serif';

const MAX_LINE_PX = 300;
const STEP_PX = 17;
const INSET_PX = 6;
const MOST_OF_PANE = 0.45;
const MOST_OF_WIDTH = 0.6; // in an inset a longer label hides more than it says

/** Where a label belongs [canvas px]: beside `x`, `y`, within `pane`; `whole`: all of it, wrapped. */
export interface LabelPlace {
  readonly x: number;
  readonly y: number;
  readonly ratio: number; // canvas px per CSS px
  readonly pane: Box;
  readonly whole: boolean;
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

interface Sprite {
  readonly canvas: HTMLCanvasElement;
  readonly width: number;
  readonly height: number;
}

// Text is slow to measure and to draw, and the same from frame to frame: what was drawn once is copied.
const MOST_KEPT = 600;
const sprites = new Map<string, Sprite>();
const widths = new Map<string, number>();
const laidOut = new Map<string, string[]>();

function remember<T>(kept: Map<string, T>, key: string, make: () => T): T {
  const known = kept.get(key);
  if (known !== undefined) return known;
  if (kept.size >= MOST_KEPT) kept.clear();
  const made = make();
  kept.set(key, made);
  return made;
}

const fontAt = (ratio: number): string => FONT.replace('13', String(13 * ratio));

function spriteOf(
  lines: readonly string[],
  width: number,
  ratio: number,
  { colour, hollow }: { readonly colour: string; readonly hollow: boolean },
): Sprite {
  return remember(sprites, `${ratio} ${colour} ${hollow} ${lines.join('\n')}`, () => {
    const inset = INSET_PX * ratio;
    const step = STEP_PX * ratio;
    const edge = Math.ceil(ratio);
    const height = step * lines.length + 4 * ratio;
    const canvas = document.createElement('canvas');
    canvas.width = Math.ceil(width) + 2 * edge;
    canvas.height = Math.ceil(height) + 2 * edge;
    const context = canvas.getContext('2d');
    if (!context) return { canvas, width, height };
    context.translate(edge, edge);
    context.font = fontAt(ratio);
    context.fillStyle = 'rgba(16, 17, 18, 0.86)';
    context.strokeStyle = colour;
    context.lineWidth = 1.5 * ratio;
    if (hollow) context.setLineDash([4 * ratio, 4 * ratio]);
    context.beginPath();
    context.roundRect(0, 0, width, height, 4 * ratio);
    context.fill();
    context.stroke();
    context.fillStyle = colour;
    context.textBaseline = 'middle';
    lines.forEach((line, i) => {
      const rightToLeft = readsRightToLeft(line);
      context.direction = rightToLeft ? 'rtl' : 'ltr';
      context.textAlign = rightToLeft ? 'right' : 'left';
      const from = rightToLeft ? width - inset : inset;
      context.fillText(line, from, step * (i + 0.5) + 2.5 * ratio);
    });
    return { canvas, width, height };
  });
}

/**
 * Where a box of that size stands: above and to the right of its point, or where it would lie over one of
 * `taken` there, in another of the four quarters; within `pane`. Undefined: in none of them.
 */
export function placeFor(
  { x, y, ratio, pane }: Omit<LabelPlace, 'whole'>,
  { width, height }: { readonly width: number; readonly height: number },
  taken: readonly Box[],
): Box | undefined {
  const beside = INSET_PX * ratio;
  const above = 4 * ratio;
  for (const [right, up] of [
    [true, true],
    [false, true],
    [true, false],
    [false, false],
  ]) {
    const left = right ? x + beside : x - beside - width;
    const top = up ? y - above - height : y + above;
    const box = {
      x: Math.max(pane.x, Math.min(left, pane.x + pane.width - width)),
      y: Math.max(pane.y, Math.min(top, pane.y + pane.height - height)),
      ...{ width, height },
    };
    if (!taken.some((other) => overlap(box, other))) return box;
  }
  return undefined;
}

/**
 * A filled box with text beside a point. Where it would lie over one of `taken` wherever it stood it is left
 * out, and otherwise joins them: of a crowd of marks some can be read, and each when chosen.
 */
export function drawLabel(
  context: CanvasRenderingContext2D,
  { text, whole }: { readonly text: string; readonly whole: string },
  place: LabelPlace,
  look: { readonly colour: string; readonly hollow: boolean },
  taken: Box[] = [],
): void {
  const { ratio, pane } = place;
  const widthOf = (line: string): number =>
    remember(widths, `${ratio} ${line}`, () => {
      context.font = fontAt(ratio);
      return context.measureText(line).width;
    });
  const inset = INSET_PX * ratio;
  const step = STEP_PX * ratio;
  const most = place.whole ? Math.min(MAX_LINE_PX * ratio, pane.width - 4 * inset) : undefined;
  let lines = [text];
  if (most !== undefined) {
    lines = remember(laidOut, `${ratio} ${most.toFixed(0)} ${whole}`, () =>
      whole.split('\n').flatMap((line) => wrap(line, (some) => widthOf(some) <= most)),
    );
  }
  // Not where it would hide what it is about; the large pane and the list have the room.
  if (place.whole && lines.length * step > MOST_OF_PANE * pane.height) lines = [text];
  const width = Math.max(...lines.map(widthOf)) + 2 * inset;
  if (!place.whole && width > MOST_OF_WIDTH * pane.width) return;
  const height = step * lines.length + 4 * ratio;
  const box = placeFor(place, { width, height }, taken);
  if (!box) return;
  taken.push(box);
  const edge = Math.ceil(ratio);
  const { canvas } = spriteOf(lines, width, ratio, look);
  context.drawImage(canvas, Math.round(box.x) - edge, Math.round(box.y) - edge);
}
