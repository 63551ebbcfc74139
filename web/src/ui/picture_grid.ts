interface Point {
  readonly x: number;
  readonly y: number;
}

type Grid = readonly (readonly (Point | undefined)[])[];

/** Draws a picture bent onto a grid of places [canvas px]; cells with a corner out of the lens stay empty. */
export function paintGrid(context: CanvasRenderingContext2D, image: ImageBitmap, grid: Grid): void {
  const rows = grid.length - 1;
  for (let row = 0; row < rows; ++row) {
    const columns = (grid[row]?.length ?? 1) - 1;
    for (let column = 0; column < columns; ++column) {
      const corner = (dx: number, dy: number): [Point, Point] | undefined => {
        const to = grid[row + dy]?.[column + dx];
        const u = ((column + dx) / columns) * image.width;
        return to && [{ x: u, y: ((row + dy) / rows) * image.height }, to];
      };
      const [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
      if (!a || !b || !c || !d) continue;
      paintTriangle(context, image, [a, b, c]);
      paintTriangle(context, image, [a, c, d]);
    }
  }
}

type Pair = readonly [Point, Point]; // in the picture, on the canvas

const OVERLAP_PX = 0.7; // or the seams show

function paintTriangle(
  context: CanvasRenderingContext2D,
  image: ImageBitmap,
  [p, q, r]: readonly [Pair, Pair, Pair],
): void {
  const [u1, v1] = [q[0].x - p[0].x, q[0].y - p[0].y];
  const [u2, v2] = [r[0].x - p[0].x, r[0].y - p[0].y];
  const determinant = u1 * v2 - u2 * v1;
  if (Math.abs(determinant) < 1e-9) return;
  const [x1, y1] = [q[1].x - p[1].x, q[1].y - p[1].y];
  const [x2, y2] = [r[1].x - p[1].x, r[1].y - p[1].y];
  const a = (x1 * v2 - x2 * v1) / determinant;
  const c = (x2 * u1 - x1 * u2) / determinant;
  const b = (y1 * v2 - y2 * v1) / determinant;
  const d = (y2 * u1 - y1 * u2) / determinant;
  const middle = {
    x: (p[1].x + q[1].x + r[1].x) / 3,
    y: (p[1].y + q[1].y + r[1].y) / 3,
  };
  context.save();
  context.beginPath();
  for (const [, at] of [p, q, r]) {
    const away = Math.hypot(at.x - middle.x, at.y - middle.y) || 1;
    const grown = 1 + OVERLAP_PX / away;
    context.lineTo(middle.x + (at.x - middle.x) * grown, middle.y + (at.y - middle.y) * grown);
  }
  context.clip();
  context.transform(a, b, c, d, p[1].x - a * p[0].x - c * p[0].y, p[1].y - b * p[0].x - d * p[0].y);
  context.drawImage(image, 0, 0);
  context.restore();
}
