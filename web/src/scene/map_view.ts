import * as THREE from 'three';
import { threeFromWorld, threeOrientation } from '../geometry/axes';
import { Camera } from '../geometry/camera';
import type { Rigid3 } from '../geometry/rigid3';
import { distance, type Vec3 } from '../geometry/vec3';
import { makeView, projectPoint, type View } from '../geometry/view';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import { FeatureCloud } from './feature_cloud';
import { Frustum } from './frustum';
import { groundGrid } from './ground_grid';
import { PathLine } from './path_line';
import { SurfaceMeshes } from './surface_meshes';
import { ThingMeshes } from './thing_meshes';
import { type ViewName, Viewpoint } from './viewpoint';

const FRUSTUM_SHARE = 0.14; // of the distance looked from: the live picture keeps its size
const SMALL_SHARE = 0.09; // where it would hide the place

const MOST_STEP_MS = 1000;
const REVEAL_PX = 40; // nearer to the edge than that is not in view

/** True without a graphics card, where smooth edges would cost more than the rest together. */
function drawsInSoftware(): boolean {
  const gl = document.createElement('canvas').getContext('webgl');
  const info = gl?.getExtension('WEBGL_debug_renderer_info');
  const name: unknown = info && gl?.getParameter(info.UNMASKED_RENDERER_WEBGL);
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return typeof name === 'string' && /swiftshader|llvmpipe|software/i.test(name);
}

/** The picture shown and where it was taken from. */
export interface ShownFrame {
  readonly frameId: number;
  readonly camera: Camera;
  readonly worldFromCamera: Rigid3;
  readonly picture: boolean; // false: where it is, without what it sees
}

/** What of the place is drawn. */
export type Look = 'surfaces' | 'both' | 'dots';

/** The 3D map: surfaces, features, the wearer's camera with its picture, its path. Marks go on top, in 2D. */
export class MapView {
  readonly eye = new Viewpoint();
  readonly surfaces: SurfaceMeshes;
  following = false;
  private looks: Look = 'both';
  /** Least time between two live pictures in the map: on slow computers the video goes first. */
  pictureIntervalMs = 0;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly surfaceScene = new THREE.Scene();
  private readonly lens = new THREE.PerspectiveCamera(45, 1, 0.01, 1000);
  private readonly cloud = new FeatureCloud();
  private readonly path = new PathLine();
  private readonly grid = groundGrid();
  private readonly frustum: Frustum;
  private readonly things: ThingMeshes;
  private readonly thingScene = new THREE.Scene();
  /** Whose edges stand out. */
  selectedThing = '';
  private width = 0; // CSS px
  private height = 0;
  private framed: { centre: Vec3; radius: number } | undefined;
  private held = false; // by hand: no more framing by itself
  private lastMs = 0;
  private contentMs = -Infinity;
  private shownFrame = -1;
  private shownPicture = false;
  private dirty = true;

  constructor(
    canvas: HTMLCanvasElement,
    picture: HTMLCanvasElement,
    private readonly session: Session,
  ) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !drawsInSoftware() });
    this.renderer.setClearColor('#131415');
    this.renderer.autoClear = false;
    this.frustum = new Frustum(picture);
    const placeOf = (id: string): Vec3 | undefined =>
      session.annotations.get(id)?.anchor.pointInWorld;
    this.things = new ThingMeshes(session.scene, placeOf, true);
    this.thingScene.add(this.things.object, this.lens);
    this.surfaces = new SurfaceMeshes(session.surface);
    this.surfaceScene.add(this.surfaces.object);
    this.scene.add(this.grid, this.cloud.object, this.path.object, this.frustum.object);
  }

  resize(width: number, height: number): void {
    if (width === this.width && height === this.height) return;
    this.width = width;
    this.height = height;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.dirty = true;
  }

  /** From now on the view moves only by hand. */
  hold(): void {
    this.held = true;
    this.dirty = true;
  }

  /** Brings the whole map into view. */
  frameAll(): void {
    this.following = false;
    this.eye.backToOrbit();
    const bounds = this.bounds();
    if (bounds) this.eye.orbit.lookAt(bounds.centre, bounds.radius);
    this.dirty = true;
  }

  /** Looks from there; says why not, where that cannot be. */
  look(view: ViewName, shown: ShownFrame | undefined): string | undefined {
    this.following = false;
    this.held = true;
    this.dirty = true;
    return this.eye.choose(view, shown, this.bounds());
  }

  /** Keeps the wearer in view, or no more. */
  follow(following: boolean): void {
    this.following = following;
    if (following) this.eye.backToOrbit();
  }

  get drawn(): Look {
    return this.looks;
  }

  /** What of the place is drawn, and fetched: dots until there are surfaces. */
  set drawn(look: Look) {
    this.looks = look;
    this.session.surface.want(look !== 'dots');
    this.dirty = true;
  }

  get showsSurfaces(): boolean {
    return this.looks !== 'dots' && !this.surfaces.empty;
  }

  get showsDots(): boolean {
    return this.looks !== 'surfaces' || this.surfaces.empty;
  }

  /** Turns to a mark that is not in view, as far off as the eye is now. */
  reveal(mark: Pick<Annotation, 'anchor'> | undefined): void {
    const point = mark?.anchor.pointInWorld;
    if (!point) return;
    const view = this.view();
    const at = projectPoint(view, point);
    if (at && view.camera.inImage(at, REVEAL_PX)) return;
    this.turnTo(point);
  }

  /** Turns to a place, as far off as the eye is now. */
  turnTo(point: Vec3): void {
    this.held = true;
    this.following = false;
    this.eye.backToOrbit();
    this.eye.orbit.follow(point);
  }

  /** The eye, in CSS pixels of this view. */
  view(): View {
    const f = this.height / 2 / Math.tan((this.eye.upright(this.aspect) * Math.PI) / 360);
    const camera = new Camera({
      model: 'pinhole',
      width: this.width,
      height: this.height,
      fx: f,
      fy: f,
      cx: this.width / 2 - 0.5,
      cy: this.height / 2 - 0.5,
      distortion: [],
    });
    return makeView(camera, this.eye.worldFromCamera());
  }

  private get aspect(): number {
    return this.width / Math.max(this.height, 1);
  }

  /** Draws if anything changed; true if so. */
  draw(nowMs: number, shown: ShownFrame | undefined): boolean {
    const elapsed = Math.min(nowMs - this.lastMs, MOST_STEP_MS);
    this.lastMs = nowMs;
    if (nowMs - this.contentMs >= this.pictureIntervalMs) this.updateContent(nowMs, shown);
    this.steer(shown);
    if (this.eye.step(elapsed, shown)) this.dirty = true;
    if (!this.dirty || this.width === 0) return false;
    this.dirty = false;
    this.aimLens();
    this.cloud.object.visible = this.showsDots;
    this.grid.visible = !this.showsSurfaces; // the place has a ground of its own
    this.path.object.visible = !this.eye.turnsHead; // it would go through one's head
    const pictureM = this.eye.pictureM(this.showsSurfaces ? SMALL_SHARE : FRUSTUM_SHARE);
    this.frustum.resize(pictureM || 1e-6);
    this.renderer.clear();
    this.things.lightFor(this.lens);
    if (this.showsSurfaces) {
      this.renderer.render(this.surfaceScene, this.lens);
      this.renderer.render(this.thingScene, this.lens);
      // Dots lie in surfaces, and the wearer may stand behind one: they are seen all the same.
      this.renderer.clearDepth();
      this.renderer.render(this.scene, this.lens);
      return true;
    }
    this.renderer.render(this.scene, this.lens);
    // After the map, of which known surfaces hide nothing.
    this.renderer.render(this.thingScene, this.lens);
    return true;
  }

  private aimLens(): void {
    const pose = this.eye.worldFromCamera();
    const p = threeFromWorld(pose.translation);
    const q = threeOrientation(pose);
    this.lens.position.set(p.x, p.y, p.z);
    this.lens.quaternion.set(q.x, q.y, q.z, q.w);
    this.lens.aspect = this.aspect;
    this.lens.fov = this.eye.upright(this.aspect);
    this.lens.updateProjectionMatrix();
    this.lens.updateMatrixWorld(); // it belongs to the second scene
  }

  private updateContent(nowMs: number, shown: ShownFrame | undefined): void {
    this.contentMs = nowMs;
    if (this.surfaces.update()) this.dirty = true;
    if (this.cloud.update(this.session.map)) this.dirty = true;
    const markers = this.session.pose?.markers ?? [];
    if (this.things.update(markers, this.selectedThing)) this.dirty = true;
    if (this.path.update(this.session.path)) this.dirty = true;
    this.updateFrustum(shown);
  }

  private updateFrustum(shown: ShownFrame | undefined): void {
    if (!shown) {
      if (this.frustum.object.visible) this.dirty = true;
      this.frustum.hide();
      this.shownFrame = -1;
    } else if (shown.frameId !== this.shownFrame || shown.picture !== this.shownPicture) {
      this.shownFrame = shown.frameId;
      this.shownPicture = shown.picture;
      this.frustum.show(shown.camera, shown.worldFromCamera, shown.picture);
      this.dirty = true;
    }
  }

  /** Follows the wearer where asked to; frames the map by itself until someone takes hold. */
  private steer(shown: ShownFrame | undefined): void {
    if (this.following && shown) {
      this.eye.orbit.follow(shown.worldFromCamera.translation);
      return;
    }
    if (this.held) return;
    const bounds = this.bounds();
    if (!bounds) return;
    const { framed } = this;
    const moved = framed ? distance(bounds.centre, framed.centre) / framed.radius : Infinity;
    const grown = framed ? Math.abs(Math.log(bounds.radius / framed.radius)) : Infinity;
    if (moved < 0.3 && grown < 0.3) return;
    this.framed = bounds;
    this.eye.orbit.lookAt(bounds.centre, bounds.radius);
  }

  /** A sphere round most features and the camera; stray ones do not count. */
  private bounds(): { centre: Vec3; radius: number } | undefined {
    const features = [...this.session.map.features.values()];
    const sure = features.filter((feature) => feature.depthKnown);
    const points = (sure.length >= 4 ? sure : features).map((feature) => feature.pointInWorld);
    if (points.length < 4) return undefined;
    const middle = (values: number[]): number =>
      values.sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? 0;
    const centre = {
      x: middle(points.map((p) => p.x)),
      y: middle(points.map((p) => p.y)),
      z: middle(points.map((p) => p.z)),
    };
    const spread = points.map((p) => distance(p, centre)).sort((a, b) => a - b);
    const most = spread[Math.floor(spread.length * 0.85)] ?? 1;
    const eye = this.session.pose?.worldFromCamera.translation;
    const radius = Math.max(most, eye ? Math.min(distance(eye, centre), 3 * most) : 0, 0.1);
    return { centre, radius };
  }
}
