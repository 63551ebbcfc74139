import * as THREE from 'three';
import { worldFromThree } from '../geometry/axes';
import type { Vec3 } from '../geometry/vec3';
import type { SceneBook, Thing } from '../session/scene_book';
import { isFixed, type PlaceOf, worldFromThing } from '../session/thing_place';
import type { MarkerPose } from '../session/types';
import { contactShadows, type PlacedMesh } from './contact_shadow';
import { lightUniforms, setLight, shadowsOf, wipesDepth } from './scene_light';
import { accent, dispose, meshesOf, pose } from './scene_meshes';

interface Shown {
  readonly thing: Thing;
  readonly group: THREE.Group;
}

/** The things of the book as three.js draws them, where they are now, with the shadows they stand in. */
export class ThingMeshes {
  readonly object = new THREE.Group();
  private readonly light = lightUniforms();
  private readonly things = new THREE.Group();
  private shadows: THREE.Mesh | undefined;
  private groups = new Map<string, Shown>();
  private version = 0;
  private building = false;
  private drawn = '';
  private placed = '';

  constructor(
    private readonly book: SceneBook,
    private readonly placeOf: PlaceOf,
    private readonly outside: boolean,
  ) {
    this.object.add(this.things, wipesDepth());
  }

  /** True if anything changed. Meshes of a model come when they are read. */
  update(markers: readonly MarkerPose[], selectedId = ''): boolean {
    this.rebuild();
    const [standing, moving]: [string[], string[]] = [[], [selectedId]];
    for (const { thing, group } of this.groups.values()) {
      const now = this.book.thing(thing.id) ?? thing;
      pose(group, worldFromThing(now, this.placeOf, markers));
      accent(group, now.id === selectedId);
      const { visible, position, quaternion, children } = group;
      const at = [visible, ...position.toArray(), ...quaternion.toArray(), children.length];
      (isFixed(now) ? moving : standing).push(at.join(' '));
    }
    const placed = `${this.version} ${standing.join()}`;
    if (placed !== this.placed) this.castShadows();
    this.placed = placed;
    const { level, towardInWorld: t, confidence } = this.book.light;
    const drawn = [placed, ...moving, level, t.x, t.y, t.z, confidence].join();
    const changed = drawn !== this.drawn;
    this.drawn = drawn;
    return changed;
  }

  /** Before each picture: light comes from the world, whatever way the eye is turned. */
  lightFor(eye: THREE.Camera): void {
    setLight(this.light, this.book.light, eye.quaternion);
  }

  private castShadows(): void {
    if (this.shadows) {
      this.object.remove(this.shadows);
      this.shadows.geometry.dispose();
      (this.shadows.material as THREE.Material).dispose();
    }
    const meshes = [...this.groups.values()]
      .filter(({ group }) => group.visible)
      .map(({ thing, group }) => placedMesh(this.book.thing(thing.id) ?? thing, group));
    const shadows = contactShadows(meshes);
    this.shadows = shadows.triangles.length > 0 ? shadowsOf(shadows) : undefined;
    if (this.shadows) this.object.add(this.shadows);
  }

  private rebuild(): void {
    if (this.building || this.version === this.book.version) return;
    this.building = true;
    const { version, things, files } = this.book;
    void Promise.all(things.map((thing) => this.meshesOf(thing, files.get(thing.modelId))))
      .then((made) => {
        const groups = new Map(made.map(({ thing, group }) => [thing.id, { thing, group }]));
        for (const { thing, group } of this.groups.values()) {
          if (groups.get(thing.id)?.group === group) continue;
          this.things.remove(group);
          dispose(group);
        }
        this.groups = groups;
        for (const { group } of groups.values()) this.things.add(group);
      })
      .finally(() => {
        this.version = version;
        this.building = false;
      });
  }

  /** One that only moved keeps its meshes. */
  private async meshesOf(thing: Thing, file: Uint8Array | undefined): Promise<Shown> {
    const before = this.groups.get(thing.id);
    if (before && before.group.children.length > 0 && looksAlike(before.thing, thing)) {
      return { thing, group: before.group };
    }
    // A model that three.js cannot read is not drawn.
    const group = await meshesOf(thing, file, this.light, this.outside).catch(
      () => new THREE.Group(),
    );
    return { thing, group };
  }
}

/** Its triangles in our world; of what moves with something none, so that its motion costs no shadows. */
function placedMesh(thing: Thing, group: THREE.Group): PlacedMesh {
  const corners: Vec3[] = [];
  if (isFixed(thing)) return { material: thing.material, corners };
  group.updateMatrixWorld(true);
  const point = new THREE.Vector3();
  for (const child of group.children) {
    if (!(child instanceof THREE.Mesh)) continue;
    const { geometry, matrixWorld } = child as THREE.Mesh;
    const [at, index] = [geometry.getAttribute('position'), geometry.getIndex()];
    const count = index ? index.count : at.count;
    for (let i = 0; i < count; ++i) {
      point.fromBufferAttribute(at, index ? index.getX(i) : i).applyMatrix4(matrixWorld);
      corners.push(worldFromThree(point));
    }
  }
  return { material: thing.material, corners };
}

const looksAlike = (a: Thing, b: Thing): boolean =>
  a.shape === b.shape &&
  a.material === b.material &&
  a.modelId === b.modelId &&
  a.scale === b.scale &&
  a.colorRgba === b.colorRgba &&
  (['x', 'y', 'z'] as const).every((axis) => a.sizeM[axis] === b.sizeM[axis]);
