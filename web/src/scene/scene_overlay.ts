import * as THREE from 'three';
import { threeFromWorld, threeOrientation } from '../geometry/axes';
import type { Camera } from '../geometry/camera';
import { clipFromEye, pinholeAround } from '../geometry/pinhole';
import type { View } from '../geometry/view';
import type { SceneBook } from '../session/scene_book';
import type { PlaceOf } from '../session/thing_place';
import type { MarkerPose } from '../session/types';
import { copied } from './scene_light';
import { ThingMeshes } from './thing_meshes';

const NEAR_M = 0.03;
const FAR_M = 200;
const CELL_PX = 8; // of the grid that bends the picture: straight within

/** The grid that shows a pinhole's picture as the lens does. */
function bentGrid(lens: Camera, pinhole: Camera): THREE.BufferGeometry {
  const { width, height } = lens.intrinsics;
  const columns = Math.ceil(width / CELL_PX);
  const rows = Math.ceil(height / CELL_PX);
  const geometry = new THREE.PlaneGeometry(2, 2, columns, rows);
  const uv = geometry.getAttribute('uv');
  const position = geometry.getAttribute('position');
  for (let i = 0; i < position.count; i++) {
    const u = ((position.getX(i) + 1) / 2) * width - 0.5;
    const v = ((1 - position.getY(i)) / 2) * height - 0.5;
    const ray = lens.unproject({ u, v });
    const at = ray && pinhole.project(ray);
    const { width: w, height: h } = pinhole.intrinsics;
    uv.setXY(i, at ? (at.u + 0.5) / w : -1, at ? 1 - (at.v + 0.5) / h : -1);
  }
  return geometry;
}

/** Virtual things over the live picture, hidden by what is real, through the lens. */
export class SceneOverlay {
  readonly canvas = document.createElement('canvas');
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly eye = new THREE.PerspectiveCamera();
  private readonly screen = new THREE.Scene();
  private readonly flat = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);
  private readonly meshes: ThingMeshes;
  private lens: Camera | undefined;
  private pinhole: Camera | undefined;
  private target: THREE.WebGLRenderTarget | undefined;

  constructor(
    private readonly book: SceneBook,
    placeOf: PlaceOf,
  ) {
    this.meshes = new ThingMeshes(book, placeOf, false);
    this.canvas.className = 'scene';
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, alpha: true });
    this.renderer.setClearColor(0x000000, 0);
    this.renderer.autoClear = true;
    this.scene.add(this.meshes.object, this.eye);
    this.eye.matrixAutoUpdate = true;
  }

  /** Draws what is seen from there; the canvas is hidden where there is nothing to draw. */
  draw(view: View | undefined, markers: readonly MarkerPose[]): void {
    this.meshes.update(markers);
    const visible =
      view !== undefined && this.book.things.some(({ material }) => material !== 'real');
    this.canvas.hidden = !visible;
    if (!visible) return;
    this.useLens(view.camera);
    if (!this.pinhole) return;
    const p = threeFromWorld(view.worldFromCamera.translation);
    const q = threeOrientation(view.worldFromCamera);
    this.eye.position.set(p.x, p.y, p.z);
    this.eye.quaternion.set(q.x, q.y, q.z, q.w);
    this.meshes.lightFor(this.eye);
    const { rotation: r, translation: t } = view.worldFromCamera;
    this.canvas.dataset['pose'] = [t.x, t.y, t.z, r.x, r.y, r.z, r.w].join(' '); // for tests
    this.renderer.setRenderTarget(this.target ?? null);
    this.renderer.render(this.scene, this.eye);
    if (!this.target) return;
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.screen, this.flat);
  }

  private useLens(lens: Camera): void {
    if (this.lens === lens) return;
    this.lens = lens;
    const { width, height } = lens.intrinsics;
    this.pinhole = lens.straight ? lens : pinholeAround(lens);
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(width, height, false);
    const rows = clipFromEye(this.pinhole, NEAR_M, FAR_M);
    this.eye.projectionMatrix.fromArray(rows as number[]).transpose();
    this.eye.projectionMatrixInverse.copy(this.eye.projectionMatrix).invert();
    this.target?.dispose();
    this.target = undefined;
    this.screen.clear();
    if (lens.straight) return;
    const { width: w, height: h } = this.pinhole.intrinsics;
    this.target = new THREE.WebGLRenderTarget(w, h, { type: THREE.HalfFloatType });
    this.screen.add(new THREE.Mesh(bentGrid(lens, this.pinhole), copied(this.target.texture)));
  }
}
