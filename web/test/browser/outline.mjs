// Where a wire frame was drawn, by its own lines: what else is drawn in its colour (a label, an arrow at
// the edge of the picture) and what lies over a part of it do not count.

export const REACH_PX = 40;
export const CLEAR = 0.6; // of its lines that have to be seen
const NEAR_PX = 1; // a line is 2 px wide

/**
 * How far [px, (u, v)] the lines `wanted` have to be moved to lie best on the pixels `drawn`; undefined
 * if no place within 40 px shows most of them.
 */
export function displacement(wanted, drawn) {
  const key = (u, v) => 65536 * Math.round(v) + Math.round(u);
  const filled = new Set(drawn.map(([u, v]) => key(u, v)));
  const hits = (du, dv) => {
    let count = 0;
    for (const [u, v] of wanted) count += filled.has(key(u + du, v + dv)) ? 1 : 0;
    return count;
  };
  let best = { count: 0, du: 0, dv: 0 };
  for (let dv = -REACH_PX; dv <= REACH_PX; ++dv) {
    for (let du = -REACH_PX; du <= REACH_PX; ++du) {
      const count = hits(du, dv);
      if (count > best.count) best = { count, du, dv };
    }
  }
  if (best.count < CLEAR * wanted.length) return undefined;
  // To a fraction of a pixel: the middle of all places as good as that, or nearly.
  let [sum, u, v] = [0, 0, 0];
  for (let dv = best.dv - 2 * NEAR_PX; dv <= best.dv + 2 * NEAR_PX; dv += 0.25) {
    for (let du = best.du - 2 * NEAR_PX; du <= best.du + 2 * NEAR_PX; du += 0.25) {
      const weight = Math.max(0, hits(du, dv) - 0.8 * best.count);
      sum += weight;
      u += weight * du;
      v += weight * dv;
    }
  }
  return [u / sum, v / sum];
}
