import type { Rigid3 } from '../geometry/rigid3';
import type { Vec3 } from '../geometry/vec3';
import {
  type GetModelResponse,
  type ListSceneResponse,
  type SceneObject,
  SceneMaterial,
  SceneShape,
} from '../gen/saccade/v1/scene_pb';
import { toRigid3, toVec3 } from './convert';

/** As docs/scene.md has it. */
export type Material = 'real' | 'virtual' | 'guide' | 'hidden';

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
  readonly parentFromObject: Rigid3;
  readonly colorRgba: number;
}

/** What the book asks of the server. */
export interface SceneCalls {
  listScene(request: { sessionId: string; knownRevision: bigint }): Promise<ListSceneResponse>;
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

const toThing = (pb: SceneObject): Thing => ({
  id: pb.id,
  name: pb.name,
  shape: SHAPES[pb.shape],
  material: MATERIALS[pb.material],
  modelId: pb.modelId,
  sizeM: toVec3(pb.sizeM),
  scale: pb.scale || 1,
  annotationId: pb.annotationId,
  parentFromObject: toRigid3(pb.parentFromObject),
  colorRgba: pb.colorRgba,
});

/** The scene as the server has it, asked for again and again; models are fetched once. */
export class SceneBook {
  things: readonly Thing[] = [];
  readonly models = new Map<string, Uint8Array>(); // GLB files
  version = 0; // rises with each change
  private revision = 0n;
  private asking = false;

  /** Looks for news; one look at a time. What fails is tried again at the next. */
  async look(calls: SceneCalls, sessionId: string): Promise<void> {
    if (this.asking || sessionId === '') return;
    this.asking = true;
    try {
      const answer = await calls.listScene({ sessionId, knownRevision: this.revision });
      if (answer.revision === this.revision) return;
      for (const { id, bytes } of answer.models) {
        if (!this.models.has(id))
          this.models.set(id, await fetchModel(calls, sessionId, id, bytes));
      }
      this.things = answer.objects.map(toThing);
      this.revision = answer.revision;
      this.version++;
    } catch {
      // The link says so elsewhere.
    } finally {
      this.asking = false;
    }
  }
}

async function fetchModel(
  calls: SceneCalls,
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
