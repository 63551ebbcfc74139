import type { Rigid3 } from '../geometry/rigid3';
import { type Vec3, ZERO } from '../geometry/vec3';
import {
  type GetModelResponse,
  type SceneEvent,
  type SceneModelFacts,
  type SceneObject,
  SceneMaterial,
  SceneShape,
} from '../gen/saccade/v1/scene_pb';
import { toRigid3, toVec3 } from './convert';

/** As docs/scene.md has it. */
export type Material = 'real' | 'virtual' | 'guide' | 'hidden';

/** A square marker that a thing is fixed to. */
export interface Marker {
  readonly family: string;
  readonly id: number;
  readonly sideM: number; // of its black border
}

/**
 * How light falls: a surface with the unit normal n is as bright as level * (1 + toward . n) times its colour.
 * Of confidence 0: nothing is known.
 */
export interface Light {
  readonly level: number;
  readonly towardInWorld: Vec3;
  readonly confidence: number; // 0 to 1
}

/** An object of the scene, in its own frame: x right, y down, z away, origin in the middle of its base. */
export interface Thing {
  readonly id: string;
  readonly name: string;
  readonly shape: 'plane' | 'box' | 'room' | 'model';
  readonly material: Material;
  readonly modelId: string; // of a model alone
  readonly sizeM: Vec3;
  readonly scale: number;
  readonly annotationId: string; // whose place it moves with; empty: the world's
  readonly marker: Marker | undefined; // that it moves with instead
  readonly parentFromObject: Rigid3;
  readonly colorRgba: number;
}

/** A GLB file that things are made of. */
export interface Model {
  readonly id: string;
  readonly name: string;
  readonly bytes: number;
  readonly sizeM: Vec3; // of its box
}

/** What the book asks of the server. */
export interface ModelCalls {
  getModel(request: {
    sessionId: string;
    modelId: string;
    offsetBytes: number;
  }): Promise<GetModelResponse>;
}

const SHAPES: Record<SceneShape, Thing['shape']> = {
  [SceneShape.UNSPECIFIED]: 'box',
  [SceneShape.PLANE]: 'plane',
  [SceneShape.BOX]: 'box',
  [SceneShape.ROOM]: 'room',
  [SceneShape.MODEL]: 'model',
};
const MATERIALS: Record<SceneMaterial, Material> = {
  [SceneMaterial.UNSPECIFIED]: 'real',
  [SceneMaterial.REAL]: 'real',
  [SceneMaterial.VIRTUAL]: 'virtual',
  [SceneMaterial.GUIDE]: 'guide',
  [SceneMaterial.HIDDEN]: 'hidden',
};

export const toThing = (pb: SceneObject): Thing => ({
  id: pb.id,
  name: pb.name,
  shape: SHAPES[pb.shape],
  material: MATERIALS[pb.material],
  modelId: pb.modelId,
  sizeM: toVec3(pb.sizeM),
  scale: pb.scale || 1,
  annotationId: pb.annotationId,
  marker: pb.marker && { family: pb.marker.family, id: pb.marker.id, sideM: pb.marker.sideM },
  parentFromObject: toRigid3(pb.parentFromObject),
  colorRgba: pb.colorRgba,
});

export const toModel = (pb: SceneModelFacts): Model => ({
  ...{ id: pb.id, name: pb.name, bytes: pb.bytes, sizeM: toVec3(pb.sizeM) },
});

/** The scene as the stream tells it; the models' files are fetched once. */
export class SceneBook {
  things: readonly Thing[] = [];
  models: readonly Model[] = [];
  readonly files = new Map<string, Uint8Array>(); // GLB, by model
  version = 0; // rises with each change but the light's
  light: Light = { level: 1, towardInWorld: ZERO, confidence: 0 };
  private readonly fetching = new Set<string>();
  private revision = 0n;

  apply(event: SceneEvent, calls: ModelCalls, sessionId: string): void {
    if (event.light) {
      const { level, towardInWorld, confidence } = event.light;
      this.light = { level, towardInWorld: toVec3(towardInWorld), confidence };
    }
    if (!event.full && event.revision === this.revision) return; // the light alone
    this.revision = event.revision;
    const kept = event.full ? [] : this.things;
    const changed = new Map(event.upserted.map((pb) => [pb.id, toThing(pb)]));
    const removed = new Set(event.removedIds);
    const things = kept
      .filter(({ id }) => !removed.has(id))
      .map((one) => changed.get(one.id) ?? one);
    const known = new Set(kept.map(({ id }) => id));
    this.things = [...things, ...[...changed.values()].filter(({ id }) => !known.has(id))];
    this.models = [...(event.full ? [] : this.models), ...event.addedModels.map(toModel)];
    this.version++;
    for (const model of this.models) void this.fetch(model, calls, sessionId);
  }

  /** What the server has answered: the stream says it again. */
  put(thing: Thing): void {
    const there = this.thing(thing.id) !== undefined;
    this.things = there
      ? this.things.map((one) => (one.id === thing.id ? thing : one))
      : [...this.things, thing];
    this.version++;
  }

  remove(id: string): void {
    this.things = this.things.filter((one) => one.id !== id);
    this.version++;
  }

  thing(id: string): Thing | undefined {
    return this.things.find((one) => one.id === id);
  }

  /** What failed is tried again with the next change. */
  private async fetch(model: Model, calls: ModelCalls, sessionId: string): Promise<void> {
    const { id, bytes } = model;
    if (this.files.has(id) || this.fetching.has(id)) return;
    this.fetching.add(id);
    try {
      this.files.set(id, await fetchModel(calls, sessionId, id, bytes));
      this.version++;
    } catch {
      // The link says so elsewhere.
    } finally {
      this.fetching.delete(id);
    }
  }
}

async function fetchModel(
  calls: ModelCalls,
  sessionId: string,
  modelId: string,
  bytes: number,
): Promise<Uint8Array> {
  const file = new Uint8Array(bytes);
  for (let offset = 0; offset < bytes; ) {
    const { data } = await calls.getModel({ sessionId, modelId, offsetBytes: offset });
    if (data.length === 0 || data.length > bytes - offset) throw new Error('a model is torn');
    file.set(data, offset);
    offset += data.length;
  }
  return file;
}
