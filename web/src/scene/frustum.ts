import * as THREE from 'three';
import { threeFromWorld, threeOrientation } from '../geometry/axes';
import type { Camera } from '../geometry/camera';
import type { Rigid3 } from '../geometry/rigid3';
import { scale, type Vec3 } from '../geometry/vec3';

const COLUMNS = 12;
const ROWS = 9;

/** The wearer's camera: a pyramid with the live picture on its base, bent as the lens bends it. */
export class Frustum {
  readonly object = new THREE.Group();
  private readonly picture: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  private readonly lines: THREE.LineSegments;
  private readonly texture: THREE.CanvasTexture;
  private camera: Camera | undefined;

  constructor(source: HTMLCanvasElement) {
    this.texture = new THREE.CanvasTexture(source);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    this.texture.generateMipmaps = false;
    this.texture.minFilter = THREE.LinearFilter;
    this.picture = new THREE.Mesh(
      new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ map: this.texture, side: THREE.DoubleSide }),
    );
    this.lines = new THREE.LineSegments(
      new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({ color: '#f2f2f2' }),
    );
    this.object.add(this.picture, this.lines);
    this.object.visible = false;
  }

  /** Shows the picture now in the source canvas at the pose it was taken from; or the camera alone. */
  show(camera: Camera, worldFromCamera: Rigid3, picture: boolean): void {
    if (camera !== this.camera) this.build(camera);
    const p = threeFromWorld(worldFromCamera.translation);
    const q = threeOrientation(worldFromCamera);
    this.object.position.set(p.x, p.y, p.z);
    this.object.quaternion.set(q.x, q.y, q.z, q.w);
    this.texture.needsUpdate = true;
    this.picture.visible = picture;
    this.object.visible = true;
  }

  /** How far the picture lies before the eye [m]: to suit how near one looks. */
  resize(depthM: number): void {
    this.object.scale.setScalar(depthM);
  }

  hide(): void {
    this.object.visible = false;
  }

  /** With the picture 1 m before the eye. */
  private build(camera: Camera): void {
    this.camera = camera;
    this.texture.dispose(); // the canvas may have changed its size
    const { width, height } = camera.intrinsics;
    const positions: number[] = [];
    const uvs: number[] = [];
    const at = (column: number, row: number): Vec3 => {
      const u = (column / COLUMNS) * width - 0.5;
      const v = (row / ROWS) * height - 0.5;
      const ray = camera.unproject({ u, v }) ?? { x: 0, y: 0, z: 1 };
      return threeFromWorld(scale(ray, 1 / Math.max(ray.z, 0.2)));
    };
    for (let row = 0; row <= ROWS; ++row) {
      for (let column = 0; column <= COLUMNS; ++column) {
        const p = at(column, row);
        positions.push(p.x, p.y, p.z);
        uvs.push(column / COLUMNS, 1 - row / ROWS);
      }
    }
    const indices: number[] = [];
    for (let row = 0; row < ROWS; ++row) {
      for (let column = 0; column < COLUMNS; ++column) {
        const a = row * (COLUMNS + 1) + column;
        const b = a + COLUMNS + 1;
        indices.push(a, b, a + 1, b, b + 1, a + 1);
      }
    }
    const mesh = this.picture.geometry;
    mesh.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    mesh.setAttribute('uv', new THREE.Float32BufferAttribute(uvs, 2));
    mesh.setIndex(indices);
    mesh.computeBoundingSphere();
    this.lines.geometry.dispose();
    this.lines.geometry = new THREE.BufferGeometry();
    this.lines.geometry.setAttribute('position', new THREE.Float32BufferAttribute(pyramid(at), 3));
  }
}

/** Segments: the eye to each corner, and round the base along the lens's curve. */
function pyramid(at: (column: number, row: number) => Vec3): number[] {
  const out: number[] = [];
  const segment = (a: Vec3, b: Vec3): void => {
    out.push(a.x, a.y, a.z, b.x, b.y, b.z);
  };
  const eye = { x: 0, y: 0, z: 0 };
  for (const column of [0, COLUMNS]) {
    for (const row of [0, ROWS]) segment(eye, at(column, row));
    for (let row = 0; row < ROWS; ++row) segment(at(column, row), at(column, row + 1));
  }
  for (const row of [0, ROWS]) {
    for (let c = 0; c < COLUMNS; ++c) segment(at(c, row), at(c + 1, row));
  }
  return out;
}
