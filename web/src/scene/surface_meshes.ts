import { MeshoptDecoder } from 'meshoptimizer/meshopt_decoder.module.js';
import * as THREE from 'three';
import { threeFromWorld } from '../geometry/axes';
import type { SurfaceChunk } from '../gen/saccade/v1/surface_pb';
import type { SurfaceBook } from '../session/surface_book';
import { type SurfaceMesh, toMesh } from '../session/surface_mesh';

const UNPACK_MS = 4; // of a screen frame: a chunk takes less than one
const UNPACK_SHARE = 0.15; // of longer ones: slow pages are to have the place as well
const MOST_UNPACK_MS = 100;

interface Shown {
  readonly mesh: SurfaceMesh;
  readonly object: THREE.Mesh;
}

/**
 * The place's surfaces as three.js draws them: one geometry a chunk, unpacked by and by. Their colours are of
 * photographs and hold the light of the place; a little shading on top lets shapes be read where colours do not.
 */
export class SurfaceMeshes {
  readonly object = new THREE.Group();
  /** Why none can be shown here; empty: they can. */
  failure = '';
  private readonly shown = new Map<string, Shown>();
  private readonly material = surfaceMaterial();
  private ready = false;
  private lastMs = 0;
  private warned = false;

  constructor(private readonly book: SurfaceBook) {
    if (!MeshoptDecoder.supported) this.failure = 'this browser has no WebAssembly';
    else
      MeshoptDecoder.ready.then(
        () => (this.ready = true),
        (error: unknown) => (this.failure = error instanceof Error ? error.message : String(error)),
      );
  }

  get empty(): boolean {
    return this.shown.size === 0;
  }

  /** As they are drawn. */
  *meshes(): Iterable<SurfaceMesh> {
    for (const { mesh } of this.shown.values()) yield mesh;
  }

  /** Triangles drawn at most, where all is in view. */
  get triangles(): number {
    let sum = 0;
    for (const mesh of this.meshes()) sum += mesh.triangles.length / 3;
    return sum;
  }

  /** Takes what has changed, for a few milliseconds; true if anything has. */
  update(): boolean {
    if (!this.ready) return false;
    const begin = performance.now();
    const share = Math.min(UNPACK_SHARE * (begin - this.lastMs), MOST_UNPACK_MS);
    const end = begin + Math.max(UNPACK_MS, share);
    this.lastMs = begin;
    let changed = false;
    while (performance.now() < end) {
      const next = this.book.takeChanged();
      if (!next) break;
      this.put(next.name, next.chunk);
      changed = true;
    }
    return changed;
  }

  private put(name: string, chunk: SurfaceChunk | undefined): void {
    let mesh: SurfaceMesh | undefined;
    try {
      mesh = chunk && toMesh(MeshoptDecoder, chunk);
    } catch (error) {
      this.warn(name, error);
    }
    this.drop(name);
    if (!mesh) return;
    const object = this.objectOf(mesh);
    this.object.add(object);
    this.shown.set(name, { mesh, object });
  }

  private drop(name: string): void {
    const before = this.shown.get(name);
    if (!before) return;
    this.object.remove(before.object);
    before.object.geometry.dispose();
    this.shown.delete(name);
  }

  private objectOf(mesh: SurfaceMesh): THREE.Mesh {
    const { places, colours, normals, triangles, originInWorld, stepM, low, high } = mesh;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(places, 4));
    geometry.setAttribute('paint', new THREE.BufferAttribute(colours, 4, true));
    geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 4, true));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    const box = new THREE.Box3(
      new THREE.Vector3(low.x, low.y, low.z),
      new THREE.Vector3(high.x, high.y, high.z),
    );
    geometry.boundingSphere = box.getBoundingSphere(new THREE.Sphere());
    const object = new THREE.Mesh(geometry, this.material);
    // Half a turn about x, as geometry/axes.ts has it: no mirror, triangles keep their sides.
    const { x, y, z } = threeFromWorld(originInWorld);
    object.position.set(x, y, z);
    object.quaternion.set(1, 0, 0, 0);
    object.scale.setScalar(stepM);
    object.updateMatrixWorld();
    object.matrixAutoUpdate = false;
    return object;
  }

  /** Once: whoever looks into it has one chunk's fault, and no flood. */
  private warn(name: string, error: unknown): void {
    if (this.warned) return;
    this.warned = true;
    console.warn(`surface chunk ${name} is not drawn:`, error);
  }
}

/** Colours are written as they are shown; the back side, which nobody has seen, is dark. */
const surfaceMaterial = (): THREE.ShaderMaterial =>
  new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    side: THREE.DoubleSide,
    blending: THREE.NoBlending,
    vertexShader: `
      in vec3 paint;
      out vec3 photo;
      void main() {
        vec4 eye = modelViewMatrix * vec4(position, 1.0);
        vec3 facing = mat3(modelViewMatrix) * normal;
        float toward = abs(dot(facing, eye.xyz)) * inversesqrt(max(dot(facing, facing) * dot(eye.xyz, eye.xyz), 1e-20));
        photo = min(paint * (0.78 + 0.26 * toward), vec3(1.0));
        gl_Position = projectionMatrix * eye;
      }`,
    fragmentShader: `
      in vec3 photo;
      out vec4 color;
      void main() {
        color = vec4(gl_FrontFacing ? photo : 0.4 * photo, 1.0);
      }`,
  });
