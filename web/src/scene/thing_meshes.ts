import * as THREE from 'three';
import type { Vec3 } from '../geometry/vec3';
import type { SceneBook, Thing } from '../session/scene_book';
import { accent, dispose, meshesOf, pose } from './scene_meshes';

/** The things of the book as three.js draws them, where they are now. */
export class ThingMeshes {
  readonly object = new THREE.Group();
  private groups = new Map<string, { readonly thing: Thing; readonly group: THREE.Group }>();
  private version = 0;
  private building = false;
  private drawn = '';

  constructor(
    private readonly book: SceneBook,
    private readonly placeOf: (annotationId: string) => Vec3 | undefined,
    private readonly outside: boolean,
  ) {}

  /** True if anything changed. Meshes of a model come when they are read. */
  update(selectedId = ''): boolean {
    this.rebuild();
    const places: string[] = [String(this.version), selectedId];
    for (const { thing, group } of this.groups.values()) {
      const now = this.book.thing(thing.id) ?? thing;
      const anchor = now.annotationId ? this.placeOf(now.annotationId) : undefined;
      pose(group, now, anchor);
      accent(group, now.id === selectedId);
      places.push(`${group.visible} ${group.position.toArray().join(' ')}`);
      places.push(group.quaternion.toArray().join(' '));
    }
    const drawn = places.join();
    const changed = drawn !== this.drawn;
    this.drawn = drawn;
    return changed;
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
          this.object.remove(group);
          dispose(group);
        }
        this.groups = groups;
        for (const { group } of groups.values()) this.object.add(group);
      })
      .finally(() => {
        this.version = version;
        this.building = false;
      });
  }

  /** One that only moved keeps its meshes. */
  private async meshesOf(
    thing: Thing,
    file: Uint8Array | undefined,
  ): Promise<{ thing: Thing; group: THREE.Group }> {
    const before = this.groups.get(thing.id);
    if (before && before.group.children.length > 0 && looksAlike(before.thing, thing)) {
      return { thing, group: before.group };
    }
    // A model that three.js cannot read is not drawn.
    const group = await meshesOf(thing, file, this.outside).catch(() => new THREE.Group());
    return { thing, group };
  }
}

const looksAlike = (a: Thing, b: Thing): boolean =>
  a.shape === b.shape &&
  a.material === b.material &&
  a.modelId === b.modelId &&
  a.scale === b.scale &&
  a.colorRgba === b.colorRgba &&
  (['x', 'y', 'z'] as const).every((axis) => a.sizeM[axis] === b.sizeM[axis]);
