import { Camera, type Intrinsics } from './camera';
import { multiply, type Quaternion, type Rigid3 } from './rigid3';
import { makeView, type View } from './view';

const H = Math.SQRT1_2;
// laidFromUpright, about the optical axis, by how far the laid picture is turned clockwise.
const TURNS: Record<number, Quaternion> = {
  0: { x: 0, y: 0, z: 0, w: 1 },
  90: { x: 0, y: 0, z: H, w: H },
  180: { x: 0, y: 0, z: 1, w: 0 },
  270: { x: 0, y: 0, z: -H, w: H },
};

/** The lens of the upright picture, where `laid` is that of the picture turned clockwise. */
export function uprightIntrinsics(laid: Intrinsics, clockwiseDeg: number): Intrinsics {
  const { width, height, fx, fy, cx, cy } = laid;
  const distortion = turnedDistortion(laid, clockwiseDeg);
  const [right, below] = [width - 1 - cx, height - 1 - cy];
  const across = { ...laid, width: height, height: width, fx: fy, fy: fx, distortion };
  switch (clockwiseDeg) {
    case 90:
      return { ...across, cx: cy, cy: right };
    case 180:
      return { ...laid, cx: right, cy: below, distortion };
    case 270:
      return { ...across, cx: below, cy: cx };
    default:
      return laid;
  }
}

/** The tangential part has a direction: (p2, p1) turns as a vector in the picture. */
function turnedDistortion({ model, distortion }: Intrinsics, deg: number): readonly number[] {
  const [k1, k2, p1, p2, ...rest] = distortion;
  if (model !== 'brown_conrady' || p1 === undefined || p2 === undefined) return distortion;
  if (k1 === undefined || k2 === undefined) return distortion;
  const turned: Record<number, readonly [number, number]> = {
    90: [-p2, p1],
    180: [-p1, -p2],
    270: [p2, -p1],
  };
  const [q1, q2] = turned[deg] ?? [p1, p2];
  return [k1, k2, q1, q2, ...rest];
}

/** The view of an upright picture, whose pose is that of the picture turned clockwise. */
export function uprightView(laid: Intrinsics, worldFromLaid: Rigid3, clockwiseDeg: number): View {
  const turn = TURNS[clockwiseDeg] ?? TURNS[0];
  const rotation = turn ? multiply(worldFromLaid.rotation, turn) : worldFromLaid.rotation;
  const camera = new Camera(uprightIntrinsics(laid, clockwiseDeg));
  return makeView(camera, { rotation, translation: worldFromLaid.translation });
}
