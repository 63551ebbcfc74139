import type { Camera } from '../geometry/camera';
import { between, type Rigid3, rotate } from '../geometry/rigid3';
import { distance, type Vec3 } from '../geometry/vec3';
import { OrbitCamera } from './orbit';

/** From where the map is looked at. */
export type ViewName = 'orbit' | 'walk' | 'above' | 'wearer';

/** The wearer's camera: where it is, and its lens. */
export interface Wearer {
  readonly camera: Camera;
  readonly worldFromCamera: Rigid3;
}

interface Sphere {
  readonly centre: Vec3;
  readonly radius: number;
}

const ORBIT_DEG = 45; // upright
const WALK_DEG = 62;
const EASE_MS = 200;
const MOST_STRIDE_MS = 200; // a slow page walks in steps one can follow
const WALKS_A_SECOND = 0.6; // of the radius of what is mapped
const AHEAD = 0.5; // of that radius: what is turned to when walking ends

/** The eye above the map, in the map, or the wearer's own. By hand it moves at once. */
export class Viewpoint {
  view: ViewName = 'orbit';
  readonly orbit = new OrbitCamera();
  /** What keys hold down: -1 to 1 to the right, and forward. */
  stride = { right: 0, forward: 0 };
  /** It is where it was to go. */
  settled = true;
  private wearer: Wearer | undefined;
  private from: { readonly pose: Rigid3; readonly deg: number } | undefined;
  private easedMs = 0;
  private radius = 1;

  /** Why it cannot be chosen now; undefined: it can. */
  choose(
    view: ViewName,
    wearer: Wearer | undefined,
    bounds: Sphere | undefined,
  ): string | undefined {
    if (view === 'wearer' && !wearer) return 'where the wearer stands is not known now';
    this.radius = bounds?.radius ?? this.radius;
    const before = this.view;
    if (view === 'wearer' || before === 'wearer') this.leave();
    this.wearer = wearer ?? this.wearer;
    this.view = view;
    const ahead = AHEAD * this.radius;
    if (view === 'walk' && wearer) {
      const forward = rotate(wearer.worldFromCamera.rotation, { x: 0, y: 0, z: 1 });
      const eye = wearer.worldFromCamera.translation;
      this.orbit.stand(eye, { ...forward, y: 0.5 * forward.y }, ahead, before === 'wearer');
    }
    if (view === 'above' && bounds) this.orbit.lookDown(bounds.centre, bounds.radius);
    if (view === 'orbit' && bounds) this.orbit.lookAt(bounds.centre, bounds.radius);
    if (view === 'orbit' && before === 'above') this.orbit.tip(0.55);
    return undefined;
  }

  /** True where turning turns the head, not the map. */
  get turnsHead(): boolean {
    return this.view === 'walk' || this.view === 'wearer';
  }

  /** Eases from what is seen now. */
  private leave(): void {
    this.from = { pose: this.worldFromCamera(), deg: this.upright() };
    this.easedMs = 0;
  }

  /** Where the eye goes by itself, it goes above the map. */
  backToOrbit(): void {
    if (this.view === 'wearer') this.takeOver();
    this.view = 'orbit';
  }

  /** By hand [rad]; the map is turned in orbit, the head where one walks. */
  rotate(dYaw: number, dPitch: number): void {
    if (this.view === 'wearer') this.takeOver();
    if (this.view === 'above' && dPitch !== 0) this.view = 'orbit';
    if (this.view === 'walk') this.orbit.look(-dYaw, -dPitch);
    else this.orbit.rotate(dYaw, dPitch);
  }

  /** By hand, in fractions of the distance. Where one walks, back and sideways. */
  pan(right: number, down: number): void {
    if (this.view === 'wearer') this.takeOver();
    if (this.view === 'walk') this.orbit.walk(right * this.radius, -down * this.radius);
    else this.orbit.pan(right, down);
  }

  /** Closer (below 1) or farther. */
  zoom(factor: number, right = 0, down = 0): void {
    if (this.view === 'wearer') this.takeOver();
    if (this.view === 'walk') this.orbit.walk(0, -Math.log(factor) * 0.5 * this.radius);
    else this.orbit.zoom(factor, right, down);
  }

  /** From the wearer's eye the hand walks on. */
  private takeOver(): void {
    const { wearer } = this;
    this.leave();
    this.view = 'walk';
    if (!wearer) return;
    const { rotation, translation } = wearer.worldFromCamera;
    const forward = rotate(rotation, { x: 0, y: 0, z: 1 });
    this.orbit.stand(translation, forward, AHEAD * this.radius, true);
  }

  /** Once per screen frame; true while something moves. */
  step(elapsedMs: number, wearer: Wearer | undefined): boolean {
    let moves = this.orbit.step(elapsedMs);
    this.settled = !moves && !this.from;
    const pose = wearer?.worldFromCamera;
    if (this.view === 'wearer' && pose && pose !== this.wearer?.worldFromCamera) moves = true;
    this.wearer = wearer ?? this.wearer;
    if (this.from) {
      this.easedMs += elapsedMs;
      if (this.easedMs >= EASE_MS) this.from = undefined;
      moves = true;
    }
    const { right, forward } = this.stride;
    if (this.view === 'walk' && (right !== 0 || forward !== 0)) {
      const way = (WALKS_A_SECOND * this.radius * Math.min(elapsedMs, MOST_STRIDE_MS)) / 1000;
      this.orbit.walk(right * way, forward * way);
      moves = true;
    }
    return moves;
  }

  /** Of the eye: x right, y down, z forward. */
  worldFromCamera(): Rigid3 {
    const goal =
      this.view === 'wearer' && this.wearer
        ? this.wearer.worldFromCamera
        : this.orbit.worldFromCamera();
    return this.from ? between(this.from.pose, goal, this.share) : goal;
  }

  /** Of the field of view [deg], in a pane of that form. */
  upright(aspect = 1): number {
    const goal = this.goalDeg(aspect);
    return this.from ? this.from.deg + (goal - this.from.deg) * this.share : goal;
  }

  /** How large the wearer's picture is drawn in the map [m]; 0: not, it would be in the way. */
  pictureM(share: number): number {
    if (this.view === 'wearer') return 0;
    const size = this.orbit.distance * share;
    if (this.view !== 'walk' || !this.wearer) return size;
    const away = distance(
      this.worldFromCamera().translation,
      this.wearer.worldFromCamera.translation,
    );
    return away < 2 * size ? 0 : size;
  }

  private get share(): number {
    const t = Math.min(this.easedMs / EASE_MS, 1);
    return t * t * (3 - 2 * t);
  }

  /** The wearer's whole picture is in it. */
  private goalDeg(aspect: number): number {
    if (this.view === 'walk') return WALK_DEG;
    if (this.view !== 'wearer' || !this.wearer) return ORBIT_DEG;
    const { width, height, fx, fy } = this.wearer.camera.intrinsics;
    const half = Math.max(height / 2 / fy, width / 2 / fx / aspect);
    return (2 * Math.atan(half) * 180) / Math.PI;
  }
}
