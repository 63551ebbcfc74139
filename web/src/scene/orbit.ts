import type { Rigid3 } from '../geometry/rigid3';
import { add, cross, distance, mix, normalise, scale, type Vec3 } from '../geometry/vec3';

interface Orbit {
  readonly target: Vec3; // in world [m]
  readonly yaw: number; // about world y [rad]; 0 looks along +z
  readonly pitch: number; // above 0 looks down [rad]
  readonly distance: number; // [m]
}

const EASE_MS = 60; // time constant: 98 % there after 240 ms
const MAX_PITCH = 1.5;

/** Where the eye above the map is, and where it is going. Moves by hand are immediate. */
export class OrbitCamera {
  private now: Orbit = { target: { x: 0, y: 0, z: 0.8 }, yaw: 0.5, pitch: 0.55, distance: 2 };
  private goal: Orbit = this.now;

  /** Moves towards the goal; true while there is still some way to go. */
  step(elapsedMs: number): boolean {
    const t = 1 - Math.exp(-elapsedMs / EASE_MS);
    const { now, goal } = this;
    const remaining =
      distance(now.target, goal.target) / goal.distance +
      Math.abs(goal.yaw - now.yaw) +
      Math.abs(goal.pitch - now.pitch) +
      Math.abs(goal.distance / now.distance - 1);
    if (remaining < 1e-4) {
      this.now = goal;
      return false;
    }
    this.now = {
      target: mix(now.target, goal.target, t),
      yaw: now.yaw + (goal.yaw - now.yaw) * t,
      pitch: now.pitch + (goal.pitch - now.pitch) * t,
      distance: now.distance * (goal.distance / now.distance) ** t,
    };
    return true;
  }

  /** Turns by hand [rad]. */
  rotate(dYaw: number, dPitch: number): void {
    const pitch = Math.min(Math.max(this.goal.pitch + dPitch, -MAX_PITCH), MAX_PITCH);
    this.jump({ ...this.goal, yaw: this.goal.yaw + dYaw, pitch });
  }

  /** Shifts by hand, in fractions of the distance, right and down as seen. */
  pan(right: number, down: number): void {
    const { x, y } = this.basis(this.goal);
    const shift = add(scale(x, right * this.goal.distance), scale(y, down * this.goal.distance));
    this.jump({ ...this.goal, target: add(this.goal.target, shift) });
  }

  /**
   * Closer (below 1) or farther, eased: a wheel comes in notches. What is at (`right`, `down`) from
   * the middle, in fractions of the distance, stays where it is on the screen.
   */
  zoom(factor: number, right = 0, down = 0): void {
    const from = this.goal.distance;
    const to = Math.min(Math.max(from * factor, 0.05), 500);
    const { x, y } = this.basis(this.goal);
    const shift = add(scale(x, right * (from - to)), scale(y, down * (from - to)));
    this.goal = { ...this.goal, distance: to, target: add(this.goal.target, shift) };
  }

  /** Turns the head by hand [rad]: the eye stays where it is. */
  look(dYaw: number, dPitch: number): void {
    const pitch = Math.min(Math.max(this.goal.pitch + dPitch, -MAX_PITCH), MAX_PITCH);
    const eye = eyeOf(this.goal);
    this.jump(seenFrom(eye, { ...this.goal, yaw: this.goal.yaw + dYaw, pitch }));
  }

  /** Walks by hand, at the same height [m]. */
  walk(right: number, forward: number): void {
    const [sin, cos] = [Math.sin(this.goal.yaw), Math.cos(this.goal.yaw)];
    const way = { x: right * cos + forward * sin, y: 0, z: forward * cos - right * sin };
    this.jump({ ...this.goal, target: add(this.goal.target, way) });
  }

  /** Eases, or jumps, to stand at `eye` looking along `forward`, with what is `ahead` [m] as target. */
  stand(eye: Vec3, forward: Vec3, ahead: number, jumps = false): void {
    const yaw = Math.atan2(forward.x, forward.z);
    const level = Math.hypot(forward.x, forward.z);
    const pitch = Math.min(Math.max(Math.atan2(forward.y, level), -MAX_PITCH), MAX_PITCH);
    const turns = Math.round((this.goal.yaw - yaw) / (2 * Math.PI)) * 2 * Math.PI; // the short way
    this.goal = seenFrom(eye, { ...this.goal, yaw: yaw + turns, pitch, distance: ahead });
    if (jumps) this.now = this.goal;
  }

  /** Eases to look straight down at a sphere [m], the world's axes along the pane's. */
  lookDown(target: Vec3, radius: number): void {
    this.lookAt(target, radius);
    const quarter = Math.PI / 2;
    const yaw = Math.round(this.goal.yaw / quarter) * quarter;
    this.goal = { ...this.goal, yaw, pitch: MAX_PITCH };
  }

  /** Eases to look down by so much [rad]. */
  tip(pitch: number): void {
    this.goal = { ...this.goal, pitch };
  }

  /** Eases to look at a sphere [m]. */
  lookAt(target: Vec3, radius: number): void {
    this.goal = { ...this.goal, target, distance: Math.max(radius, 0.05) * 2.4 };
  }

  /** Eases to a target, keeping direction and distance. */
  follow(target: Vec3): void {
    this.goal = { ...this.goal, target };
  }

  /** From the eye to what it looks at [m]. */
  get distance(): number {
    return this.now.distance;
  }

  /** Of the eye: x right, y down, z forward. */
  worldFromCamera(): Rigid3 {
    const { x, y, z } = this.basis(this.now);
    return {
      translation: add(this.now.target, scale(z, -this.now.distance)),
      rotation: quaternionOf(x, y, z),
    };
  }

  private jump(orbit: Orbit): void {
    this.goal = orbit;
    this.now = orbit;
  }

  private basis(orbit: Orbit): { x: Vec3; y: Vec3; z: Vec3 } {
    const z = forwardOf(orbit);
    const x = normalise(cross({ x: 0, y: 1, z: 0 }, z));
    return { x, y: cross(z, x), z };
  }
}

const forwardOf = ({ yaw, pitch }: Orbit): Vec3 => ({
  x: Math.sin(yaw) * Math.cos(pitch),
  y: Math.sin(pitch),
  z: Math.cos(yaw) * Math.cos(pitch),
});

const eyeOf = (orbit: Orbit): Vec3 => add(orbit.target, scale(forwardOf(orbit), -orbit.distance));

/** The same view from `eye`. */
const seenFrom = (eye: Vec3, orbit: Orbit): Orbit => ({
  ...orbit,
  target: add(eye, scale(forwardOf(orbit), orbit.distance)),
});

/** Of the rotation whose columns are x, y, z. */
function quaternionOf(x: Vec3, y: Vec3, z: Vec3): Rigid3['rotation'] {
  const trace = x.x + y.y + z.z;
  if (trace > 0) {
    const s = 2 * Math.sqrt(trace + 1);
    return { x: (y.z - z.y) / s, y: (z.x - x.z) / s, z: (x.y - y.x) / s, w: s / 4 };
  }
  if (x.x > y.y && x.x > z.z) {
    const s = 2 * Math.sqrt(1 + x.x - y.y - z.z);
    return { x: s / 4, y: (y.x + x.y) / s, z: (z.x + x.z) / s, w: (y.z - z.y) / s };
  }
  if (y.y > z.z) {
    const s = 2 * Math.sqrt(1 + y.y - x.x - z.z);
    return { x: (y.x + x.y) / s, y: s / 4, z: (z.y + y.z) / s, w: (z.x - x.z) / s };
  }
  const s = 2 * Math.sqrt(1 + z.z - x.x - y.y);
  return { x: (z.x + x.z) / s, y: (z.y + y.z) / s, z: s / 4, w: (x.y - y.x) / s };
}
