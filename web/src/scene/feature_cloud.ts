import * as THREE from 'three';
import { threeFromWorld } from '../geometry/axes';
import { principalAxes } from '../geometry/covariance';
import type { MapState } from '../session/map_state';
import { FEATURE_COLOURS } from './colours';
import { makeDot } from './dot';

const MAX = 4096;
const MAX_SIGMA_M = 0.5; // longer ones are drawn this long: they say "unknown" well enough

/** Every feature as a dot in its colour with a line one sigma either way along its worst axis. */
export class FeatureCloud {
  readonly object = new THREE.Group();
  private readonly points: THREE.Points;
  private readonly lines: THREE.LineSegments;
  private version = -1;

  constructor() {
    this.points = new THREE.Points(
      buffers(MAX),
      new THREE.PointsMaterial({
        size: 7,
        sizeAttenuation: false,
        vertexColors: true,
        map: makeDot(),
        alphaTest: 0.5,
      }),
    );
    this.lines = new THREE.LineSegments(
      buffers(2 * MAX),
      new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.45 }),
    );
    for (const child of [this.lines, this.points]) {
      child.frustumCulled = false;
      this.object.add(child);
    }
  }

  /** True if something changed. */
  update(map: MapState): boolean {
    if (map.version === this.version) return false;
    this.version = map.version;
    const dots = new Writer(this.points.geometry);
    const ends = new Writer(this.lines.geometry);
    for (const feature of map.features.values()) {
      if (dots.full) break;
      const colour = FEATURE_COLOURS[feature.state];
      const at = feature.pointInWorld;
      dots.put(at, colour);
      if (!feature.covariance) continue;
      const [axis] = principalAxes(feature.covariance);
      const length = Math.hypot(axis.x, axis.y, axis.z);
      if (!(length > 0)) continue;
      const s = Math.min(1, MAX_SIGMA_M / length);
      ends.put({ x: at.x - s * axis.x, y: at.y - s * axis.y, z: at.z - s * axis.z }, colour);
      ends.put({ x: at.x + s * axis.x, y: at.y + s * axis.y, z: at.z + s * axis.z }, colour);
    }
    dots.finish();
    ends.finish();
    return true;
  }
}

function buffers(count: number): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  for (const name of ['position', 'color']) {
    const attribute = new THREE.BufferAttribute(new Float32Array(3 * count), 3);
    geometry.setAttribute(name, attribute.setUsage(THREE.DynamicDrawUsage));
  }
  return geometry;
}

/** Fills a geometry from its start. */
class Writer {
  private count = 0;
  private readonly position: THREE.BufferAttribute;
  private readonly color: THREE.BufferAttribute;

  constructor(private readonly geometry: THREE.BufferGeometry) {
    this.position = geometry.getAttribute('position') as THREE.BufferAttribute;
    this.color = geometry.getAttribute('color') as THREE.BufferAttribute;
  }

  get full(): boolean {
    return this.count >= MAX;
  }

  put(pointInWorld: { x: number; y: number; z: number }, colour: THREE.Color): void {
    const p = threeFromWorld(pointInWorld);
    this.position.setXYZ(this.count, p.x, p.y, p.z);
    this.color.setXYZ(this.count, colour.r, colour.g, colour.b);
    ++this.count;
  }

  finish(): void {
    this.position.needsUpdate = true;
    this.color.needsUpdate = true;
    this.geometry.setDrawRange(0, this.count);
  }
}
