import { add, scale, ZERO } from '../geometry/vec3';
import type { Material, Model, Thing } from '../session/scene_book';
import type { SceneEdits, ThingDraft } from '../session/scene_edits';
import type { Session } from '../session/session';
import { DOWN } from '../tools/thing_places';
import { about } from '../tools/turn';
import { libraryFile } from './thing_library';
import { behind, type Overlay, type OverlayPoint } from './thing_overlays';

const MODEL_NAME_BYTES = 90;

/** Models that things are made of: of the library, of the server, of a file. */
export class ThingModels {
  constructor(
    private readonly session: Session,
    private readonly edits: SceneEdits,
  ) {}

  /** Of "library NAME" or "model ID". */
  async of(does: string): Promise<Model> {
    const name = does.slice(does.indexOf(' ') + 1);
    const known = this.session.scene.models.find(({ id }) => id === name);
    if (known) return known;
    return this.edits.upload(name, await libraryFile(name), () => undefined);
  }

  ofFile(file: File, bytes: Uint8Array, told: (share: number) => void): Promise<Model> {
    const name = file.name.replace(/\.[a-z]+$/i, '').slice(0, MODEL_NAME_BYTES) || 'model';
    return this.edits.upload(name, bytes, told);
  }

  draft({ id, name }: Model, material: Material = 'virtual'): ThingDraft {
    return {
      ...{ name: this.freeName(name), shape: 'model', material, modelId: id },
      ...{ sizeM: ZERO, scale: 1, annotationId: '', marker: undefined, colorRgba: 0 },
      parentFromObject: { rotation: about(DOWN, 0), translation: ZERO },
    };
  }

  async lay({ name, material, file, pose }: Overlay): Promise<Thing> {
    const model = await this.edits.upload(name, file, () => undefined);
    const draft = this.draft({ ...model, name }, material);
    return this.edits.put({ ...draft, parentFromObject: pose });
  }

  /** Drawn through the surface it is behind, its middle where that was clicked. */
  show(model: Model, point: OverlayPoint): Promise<Thing> {
    const pose = behind(point);
    const translation = add(pose.translation, scale(DOWN, model.sizeM.y / 2)); // its base
    const draft = this.draft(model, 'hidden');
    return this.edits.put({ ...draft, parentFromObject: { ...pose, translation } });
  }

  freeName(name: string): string {
    const taken = new Set(this.session.scene.things.map((one) => one.name));
    let free = name;
    for (let n = 2; taken.has(free); ++n) free = `${name} ${n}`;
    return free;
  }
}
