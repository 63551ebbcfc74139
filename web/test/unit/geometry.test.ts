import { describe, expect, it } from 'vitest';
import { threeFromWorld, threeOrientation, worldFromThree } from '../../src/geometry/axes';
import { Camera, type Intrinsics } from '../../src/geometry/camera';
import { imageEllipse, largestSigma, principalAxes } from '../../src/geometry/covariance';
import { fitPlane, intersect } from '../../src/geometry/plane';
import { projectPolyline } from '../../src/geometry/polyline';
import {
  compose,
  IDENTITY,
  inverse,
  type Rigid3,
  rotate,
  transform,
} from '../../src/geometry/rigid3';
import { distance, type Pixel, pixelDistance, type Vec3 } from '../../src/geometry/vec3';

const base = { width: 640, height: 480, fx: 517.3, fy: 516.5, cx: 318.6, cy: 255.3 };
const lenses: Intrinsics[] = [
  { ...base, model: 'pinhole', distortion: [] },
  {
    ...base,
    width: 320,
    height: 240,
    fx: 195,
    fy: 195,
    cx: 162,
    cy: 125,
    model: 'radial1',
    distortion: [9e-6],
  },
  { ...base, model: 'brown_conrady', distortion: [0.2624, -0.9531, -0.0054, 0.0026, 1.1633] },
  {
    ...base,
    fx: 280,
    fy: 280,
    cx: 319.5,
    cy: 239.5,
    model: 'kannala_brandt',
    distortion: [-0.01, 0.03, -0.02, 0.004],
  },
  { ...base, fx: 280, fy: 280, cx: 319.5, cy: 239.5, model: 'fov', distortion: [0.92] },
];

const turn: Rigid3 = {
  rotation: { x: 0, y: Math.SQRT1_2, z: 0, w: Math.SQRT1_2 },
  translation: { x: 1, y: 2, z: 3 },
};

describe('rigid3', () => {
  it('turns forward to world x for the worked number of geometry.proto', () => {
    const forward = rotate(turn.rotation, { x: 0, y: 0, z: 1 });
    expect(distance(forward, { x: 1, y: 0, z: 0 })).toBeLessThan(1e-12);
  });

  it('inverse and compose cancel', () => {
    const p = { x: 0.3, y: -1, z: 2 };
    const there = transform(turn, p);
    expect(distance(transform(inverse(turn), there), p)).toBeLessThan(1e-12);
    expect(distance(transform(compose(inverse(turn), turn), p), p)).toBeLessThan(1e-12);
  });
});

describe.each(lenses)('camera $model', (intrinsics) => {
  const camera = new Camera(intrinsics);

  it('projects what it unprojected, over the whole picture', () => {
    let tried = 0;
    for (let u = 0; u < intrinsics.width; u += 13) {
      for (let v = 0; v < intrinsics.height; v += 11) {
        const ray = camera.unproject({ u, v });
        if (!ray) continue; // beyond where this lens can be inverted
        ++tried;
        const again = camera.project(ray);
        expect(again && pixelDistance(again, { u, v })).toBeLessThan(1e-6);
      }
    }
    expect(tried).toBeGreaterThan(intrinsics.width * 1.5); // most of the picture, whatever its size
  });

  it('sees nothing behind itself', () => {
    expect(camera.project({ x: 0.1, y: 0, z: -1 })).toBeUndefined();
  });

  it('looks straight ahead at its principal point', () => {
    const at = camera.project({ x: 0, y: 0, z: 2 });
    expect(at).toEqual({ u: intrinsics.cx, v: intrinsics.cy });
  });
});

describe('lens formulas', () => {
  it('radial1 pulls in as u / sqrt(1 + 2 k1 u^2), in pixels', () => {
    const camera = new Camera({
      ...base,
      model: 'radial1',
      fx: 100,
      fy: 100,
      cx: 0,
      cy: 0,
      distortion: [1e-5],
    });
    const at = camera.project({ x: 1, y: 0, z: 1 });
    expect(at?.u).toBeCloseTo(100 / Math.sqrt(1.2), 10);
  });

  it('fov bends as atan(2 r tan(w / 2)) / w', () => {
    const camera = new Camera({
      ...base,
      model: 'fov',
      fx: 100,
      fy: 100,
      cx: 0,
      cy: 0,
      distortion: [1],
    });
    const at = camera.project({ x: 2, y: 0, z: 1 });
    expect(at?.u).toBeCloseTo(100 * Math.atan(4 * Math.tan(0.5)), 10);
  });

  it('brown_conrady has the five coefficients in OpenCV order', () => {
    const distortion = [0.1, 0.01, 0.002, 0.003, 0.001];
    const camera = new Camera({
      ...base,
      model: 'brown_conrady',
      fx: 1,
      fy: 1,
      cx: 0,
      cy: 0,
      distortion,
    });
    // x = 0.2, y = 0.1: r^2 = 0.05, radial = 1.005025125
    const at = camera.project({ x: 0.2, y: 0.1, z: 1 });
    expect(at?.u).toBeCloseTo(0.2 * 1.005025125 + 2 * 0.002 * 0.02 + 0.003 * (0.05 + 0.08), 12);
    expect(at?.v).toBeCloseTo(0.1 * 1.005025125 + 0.002 * (0.05 + 0.02) + 2 * 0.003 * 0.02, 12);
  });
});

describe('projectPolyline', () => {
  const camera = new Camera(lenses[1] ?? lenses[0]!);
  const line: Vec3[] = [
    { x: -1.2, y: 0.9, z: 1.5 },
    { x: 1.2, y: 0.9, z: 1.5 },
  ];

  it('bends with the lens: no piece is off by more than a quarter of a pixel', () => {
    const pieces = projectPolyline(camera, IDENTITY, line);
    const points = pieces.flat();
    expect(points.length).toBeGreaterThan(5);
    for (let i = 0; i <= 1000; ++i) {
      const truth = camera.project({ x: -1.2 + (2.4 * i) / 1000, y: 0.9, z: 1.5 });
      if (!truth || !camera.inImage(truth)) continue;
      expect(nearestOnPolyline(points, truth)).toBeLessThan(0.25);
    }
  });

  it('cuts at the near plane instead of turning inside out', () => {
    const through: Vec3[] = [
      { x: 0, y: 0, z: -1 },
      { x: 0.1, y: 0, z: 1 },
    ];
    const points = projectPolyline(camera, IDENTITY, through).flat();
    expect(points.length).toBeGreaterThan(1);
    expect(points.every((p) => Number.isFinite(p.u) && Number.isFinite(p.v))).toBe(true);
  });

  it('draws nothing of what is behind or far outside', () => {
    const behind = line.map((p) => ({ ...p, z: -1 }));
    expect(projectPolyline(camera, IDENTITY, behind)).toEqual([]);
    const outside = line.map((p) => ({ ...p, y: 50 }));
    expect(projectPolyline(camera, IDENTITY, outside)).toEqual([]);
  });

  it('finds a line that only crosses the picture in its middle', () => {
    const wide: Vec3[] = [
      { x: -3, y: 0.1, z: 1 },
      { x: 3, y: 0.1, z: 1 },
    ];
    const points = projectPolyline(new Camera(lenses[0]!), IDENTITY, wide).flat();
    const us = points.map((p) => p.u);
    expect(Math.min(...us)).toBeLessThan(5);
    expect(Math.max(...us)).toBeGreaterThan(634);
  });
});

function nearestOnPolyline(points: readonly Pixel[], p: Pixel): number {
  let best = Infinity;
  for (let i = 1; i < points.length; ++i) {
    const a = points[i - 1]!;
    const b = points[i]!;
    const du = b.u - a.u;
    const dv = b.v - a.v;
    const t = Math.min(Math.max(((p.u - a.u) * du + (p.v - a.v) * dv) / (du * du + dv * dv), 0), 1);
    best = Math.min(best, Math.hypot(a.u + t * du - p.u, a.v + t * dv - p.v));
  }
  return best;
}

describe('covariance', () => {
  it('finds the axes of a turned ellipsoid', () => {
    // 3, 1, 0.5 along the axes of a quarter turn in the x-y plane by 30 degrees.
    const c = Math.cos(Math.PI / 6);
    const s = Math.sin(Math.PI / 6);
    const upper = [9 * c * c + s * s, (9 - 1) * c * s, 0, 9 * s * s + c * c, 0, 0.25] as const;
    const [long, middle, short] = principalAxes(upper);
    expect(Math.abs(long.x)).toBeCloseTo(3 * c, 9);
    expect(Math.abs(long.y)).toBeCloseTo(3 * s, 9);
    expect(Math.hypot(middle.x, middle.y)).toBeCloseTo(1, 9);
    expect(Math.abs(short.z)).toBeCloseTo(0.5, 9);
    expect(largestSigma(upper)).toBeCloseTo(3, 9);
  });

  it('projects to an ellipse: f sigma / z across, nothing along the ray', () => {
    const camera = new Camera({ ...base, model: 'pinhole', distortion: [] });
    const axes = imageEllipse(camera, IDENTITY, { x: 0, y: 0, z: 2 }, [1e-4, 0, 0, 4e-4, 0, 1e-2]);
    expect(Math.hypot(axes?.[0]?.u ?? 0, axes?.[0]?.v ?? 0)).toBeCloseTo((516.5 * 0.02) / 2, 2);
    expect(Math.hypot(axes?.[1]?.u ?? 0, axes?.[1]?.v ?? 0)).toBeCloseTo((517.3 * 0.01) / 2, 2);
  });
});

describe('plane', () => {
  const points = [
    { x: 0, y: 1, z: 2 },
    { x: 1, y: 1, z: 2.5 },
    { x: 0, y: 1, z: 4 },
    { x: -2, y: 1, z: 3 },
  ];

  it('fits points and is met by a ray', () => {
    const plane = fitPlane(points);
    expect(plane?.residual).toBeLessThan(1e-9);
    const at = plane && intersect(plane, { x: 0, y: 0, z: 0 }, { x: 0, y: 1, z: 3 });
    expect(at && distance(at, { x: 0, y: 1, z: 3 })).toBeLessThan(1e-9);
  });

  it('is not met behind the eye, nor fitted to a line', () => {
    const plane = fitPlane(points);
    expect(plane && intersect(plane, { x: 0, y: 0, z: 0 }, { x: 0, y: -1, z: 3 })).toBeUndefined();
    expect(fitPlane([0, 1, 2, 3].map((x) => ({ x, y: 0, z: 1 })))).toBeUndefined();
  });
});

describe('axes', () => {
  it('takes our down to three.js down, forward to -z, and back', () => {
    const p = { x: 1, y: 2, z: 3 };
    expect(threeFromWorld(p)).toEqual({ x: 1, y: -2, z: -3 });
    expect(worldFromThree(threeFromWorld(p))).toEqual(p);
  });

  it('gives a three.js camera the direction of ours', () => {
    // three.js cameras look along -z with y up; ours along +z with y down.
    const looks = rotate(threeOrientation(turn), { x: 0, y: 0, z: -1 });
    const wanted = threeFromWorld(rotate(turn.rotation, { x: 0, y: 0, z: 1 }));
    expect(distance(looks, wanted)).toBeLessThan(1e-12);
    const up = rotate(threeOrientation(turn), { x: 0, y: 1, z: 0 });
    const wantedUp = threeFromWorld(rotate(turn.rotation, { x: 0, y: -1, z: 0 }));
    expect(distance(up, wantedUp)).toBeLessThan(1e-12);
  });
});
