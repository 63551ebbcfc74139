import type { Pixel, Vec3 } from './vec3';

export type LensModel = 'pinhole' | 'radial1' | 'brown_conrady' | 'kannala_brandt' | 'fov';

/** Same meaning as `camera.yaml`: slam-spec section 4. */
export interface Intrinsics {
  readonly model: LensModel;
  readonly width: number;
  readonly height: number;
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
  readonly distortion: readonly number[];
}

interface Point2 {
  readonly x: number;
  readonly y: number;
}

/** A lens: maps undistorted normalised points (x/z, y/z) or angles to distorted ones and back. */
interface Lens {
  /** Distorted normalised point of a direction; undefined where the lens is not invertible. */
  distort(p: Vec3): Point2 | undefined;
  /** A direction (any length) of a distorted normalised point. */
  undistort(d: Point2): Vec3 | undefined;
}

/**
 * Maps points in the camera frame (x right, y down, z forward, metres) to distorted pixels and back.
 * The same models, limits and units as `shared/camera` on the server.
 */
export class Camera {
  private readonly lens: Lens;

  constructor(readonly intrinsics: Intrinsics) {
    this.lens = makeLens(intrinsics);
  }

  /** Undefined behind the camera and where the distortion is not invertible. */
  project(pointInCamera: Vec3): Pixel | undefined {
    const d = this.lens.distort(pointInCamera);
    if (!d) return undefined;
    const { fx, fy, cx, cy } = this.intrinsics;
    return { u: fx * d.x + cx, v: fy * d.y + cy };
  }

  /** Direction of length 1 in the camera frame; undefined where not invertible. */
  unproject(pixel: Pixel): Vec3 | undefined {
    const { fx, fy, cx, cy } = this.intrinsics;
    const ray = this.lens.undistort({ x: (pixel.u - cx) / fx, y: (pixel.v - cy) / fy });
    if (!ray) return undefined;
    const length = Math.hypot(ray.x, ray.y, ray.z);
    return { x: ray.x / length, y: ray.y / length, z: ray.z / length };
  }

  /** True where straight lines appear straight. */
  get straight(): boolean {
    return this.intrinsics.model === 'pinhole';
  }

  inImage(pixel: Pixel, border = 0): boolean {
    const { width, height } = this.intrinsics;
    return (
      pixel.u >= border &&
      pixel.v >= border &&
      pixel.u <= width - 1 - border &&
      pixel.v <= height - 1 - border
    );
  }
}

function makeLens(intrinsics: Intrinsics): Lens {
  switch (intrinsics.model) {
    case 'pinhole':
      return pinhole;
    case 'radial1':
      return radial1(intrinsics);
    case 'brown_conrady':
      return brownConrady(intrinsics.distortion);
    case 'kannala_brandt':
      return kannalaBrandt(intrinsics.distortion);
    case 'fov':
      return fieldOfView(intrinsics.distortion);
  }
}

const MIN_DEPTH = 1e-9;

const pinhole: Lens = {
  distort: (p) => (p.z > MIN_DEPTH ? { x: p.x / p.z, y: p.y / p.z } : undefined),
  undistort: (d) => ({ x: d.x, y: d.y, z: 1 }),
};

/** u_d = u / sqrt(1 + 2 k1 |u|^2), u in pixels from the centre. */
function radial1({ fx, fy, distortion }: Intrinsics): Lens {
  const k1 = distortion[0] ?? 0;
  const squared = (x: number, y: number): number => fx * fx * x * x + fy * fy * y * y;
  return {
    distort: (p) => {
      if (p.z <= MIN_DEPTH) return undefined;
      const x = p.x / p.z;
      const y = p.y / p.z;
      const f = 1 + 2 * k1 * squared(x, y);
      return f > 0 ? { x: x / Math.sqrt(f), y: y / Math.sqrt(f) } : undefined;
    },
    undistort: (d) => {
      const f = 1 - 2 * k1 * squared(d.x, d.y);
      return f > 0 ? { x: d.x / Math.sqrt(f), y: d.y / Math.sqrt(f), z: 1 } : undefined;
    },
  };
}

/** Largest r up to which r * radial(r^2) rises, found on a fine grid. */
function monotonicLimit(derivative: (r: number) => number, limit: number): number {
  const steps = 2000;
  for (let i = 1; i <= steps; ++i) {
    if (derivative((limit * i) / steps) <= 0) return (limit * (i - 1)) / steps;
  }
  return limit;
}

/** OpenCV's five coefficients k1 k2 p1 p2 k3. */
function brownConrady(distortion: readonly number[]): Lens {
  const [k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0] = distortion;
  const radial = (s: number): number => 1 + s * (k1 + s * (k2 + s * k3));
  const slope = (r: number): number => {
    const s = r * r;
    return 1 + s * (3 * k1 + s * (5 * k2 + s * 7 * k3));
  };
  const maxRadius = monotonicLimit(slope, 20);
  const forward = (x: number, y: number): Point2 => {
    const s = x * x + y * y;
    const f = radial(s);
    return {
      x: x * f + 2 * p1 * x * y + p2 * (s + 2 * x * x),
      y: y * f + p1 * (s + 2 * y * y) + 2 * p2 * x * y,
    };
  };
  return {
    distort: (p) => {
      if (p.z <= MIN_DEPTH) return undefined;
      const x = p.x / p.z;
      const y = p.y / p.z;
      return Math.hypot(x, y) <= maxRadius ? forward(x, y) : undefined;
    },
    undistort: (d) => {
      const found = newton2(forward, d);
      if (!found || Math.hypot(found.x, found.y) > maxRadius) return undefined;
      return { x: found.x, y: found.y, z: 1 };
    },
  };
}

/** Solves f(x) = target from `target` itself, with numeric derivatives. */
function newton2(f: (x: number, y: number) => Point2, target: Point2): Point2 | undefined {
  let { x, y } = target;
  const h = 1e-6;
  for (let i = 0; i < 30; ++i) {
    const at = f(x, y);
    const ex = target.x - at.x;
    const ey = target.y - at.y;
    if (Math.abs(ex) + Math.abs(ey) < 1e-13) return { x, y };
    const dx = f(x + h, y);
    const dy = f(x, y + h);
    const a = (dx.x - at.x) / h;
    const b = (dy.x - at.x) / h;
    const c = (dx.y - at.y) / h;
    const e = (dy.y - at.y) / h;
    const det = a * e - b * c;
    if (Math.abs(det) < 1e-12) return undefined;
    x += (e * ex - b * ey) / det;
    y += (a * ey - c * ex) / det;
    if (!Number.isFinite(x + y)) return undefined;
  }
  const end = f(x, y);
  return Math.hypot(end.x - target.x, end.y - target.y) < 1e-9 ? { x, y } : undefined;
}

/** th_d = th (1 + k1 th^2 + k2 th^4 + k3 th^6 + k4 th^8). */
function kannalaBrandt(distortion: readonly number[]): Lens {
  const [k1 = 0, k2 = 0, k3 = 0, k4 = 0] = distortion;
  const bend = (t: number): number => {
    const s = t * t;
    return t * (1 + s * (k1 + s * (k2 + s * (k3 + s * k4))));
  };
  const slope = (t: number): number => {
    const s = t * t;
    return 1 + s * (3 * k1 + s * (5 * k2 + s * (7 * k3 + s * 9 * k4)));
  };
  const maxAngle = monotonicLimit(slope, Math.PI);
  return {
    distort: (p) => {
      const r = Math.hypot(p.x, p.y);
      const angle = Math.atan2(r, p.z);
      if (p.z <= MIN_DEPTH || angle > maxAngle) return undefined;
      if (r < 1e-12) return { x: 0, y: 0 };
      const bent = bend(angle);
      return { x: (bent * p.x) / r, y: (bent * p.y) / r };
    },
    undistort: (d) => {
      const bent = Math.hypot(d.x, d.y);
      if (bent < 1e-12) return { x: 0, y: 0, z: 1 };
      let angle = Math.min(bent, maxAngle);
      for (let i = 0; i < 30; ++i) {
        const step = (bend(angle) - bent) / slope(angle);
        angle = Math.min(Math.max(angle - step, 0), maxAngle);
        if (Math.abs(step) < 1e-13) break;
      }
      if (Math.abs(bend(angle) - bent) > 1e-9) return undefined;
      const s = Math.sin(angle) / bent;
      return { x: d.x * s, y: d.y * s, z: Math.cos(angle) };
    },
  };
}

/** r_d = atan(2 r tan(w / 2)) / w, r the tangent of the angle to the optic axis. */
function fieldOfView(distortion: readonly number[]): Lens {
  const [w = 0] = distortion;
  if (!(w > 0)) return pinhole;
  const s = 2 * Math.tan(w / 2);
  return {
    distort: (p) => {
      if (p.z <= MIN_DEPTH) return undefined;
      const r = Math.hypot(p.x, p.y);
      if (r < 1e-12) return { x: 0, y: 0 };
      const bent = Math.atan2(s * r, p.z) / w;
      return { x: (bent * p.x) / r, y: (bent * p.y) / r };
    },
    undistort: (d) => {
      const bent = Math.hypot(d.x, d.y);
      const angle = bent * w;
      if (angle >= Math.PI / 2) return undefined;
      const sine = bent < 1e-12 ? w / s : Math.sin(angle) / (s * bent);
      return { x: d.x * sine, y: d.y * sine, z: Math.cos(angle) };
    },
  };
}
