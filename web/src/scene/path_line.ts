import * as THREE from 'three';
import { threeFromWorld } from '../geometry/axes';
import { distance, type Vec3 } from '../geometry/vec3';
import type { Pose } from '../session/types';

const MAX = 4000;
const SPACING_M = 0.005;

/** Where the camera has been: a thin line through poses as they were published. */
export class PathLine {
  readonly object: THREE.Line;
  private used = 0; // poses read
  private count = 0; // points drawn
  private last: Vec3 | undefined;
  private newest: Pose | undefined;

  constructor() {
    const geometry = new THREE.BufferGeometry();
    const attribute = new THREE.BufferAttribute(new Float32Array(3 * MAX), 3);
    geometry.setAttribute('position', attribute.setUsage(THREE.DynamicDrawUsage));
    this.object = new THREE.Line(
      geometry,
      new THREE.LineBasicMaterial({ color: '#9aa0a6', transparent: true, opacity: 0.8 }),
    );
    this.object.frustumCulled = false;
  }

  update(path: readonly Pose[]): boolean {
    const newest = path.at(-1);
    if (newest === this.newest) return false;
    if (path.length < this.used || this.count >= MAX) this.restart(path);
    this.newest = newest;
    const attribute = this.object.geometry.getAttribute('position') as THREE.BufferAttribute;
    for (; this.used < path.length && this.count < MAX; ++this.used) {
      const at = path[this.used]?.worldFromCamera.translation;
      if (!at || (this.last && distance(at, this.last) < SPACING_M)) continue;
      const p = threeFromWorld(at);
      attribute.setXYZ(this.count++, p.x, p.y, p.z);
      this.last = at;
    }
    attribute.needsUpdate = true;
    this.object.geometry.setDrawRange(0, this.count);
    return true;
  }

  /** The path was cut (new map, or old poses dropped), or the line is full: keep its newest part. */
  private restart(path: readonly Pose[]): void {
    this.used = Math.max(0, path.length - MAX / 2);
    this.count = 0;
    this.last = undefined;
  }
}
