import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { QuaternionSchema, Rigid3Schema, Vector3Schema } from '../gen/saccade/v1/geometry_pb';
import {
  type SceneContact,
  SceneMaterial,
  SceneObjectSchema,
  SceneShape,
} from '../gen/saccade/v1/scene_pb';
import type { Vec3 } from '../geometry/vec3';
import { plainWords } from '../transport/errors';
import { EditError } from './edits';
import { type Model, type Thing, toModel, toThing } from './scene_book';
import type { Session } from './session';
import { newUuid } from './uuid';

/** A thing before the server has given it an id. */
export type ThingDraft = Omit<Thing, 'id'> & { readonly id?: string };

export interface Touch {
  readonly name: string;
  readonly movedM: number;
}
export interface Placed {
  readonly thing: Thing;
  readonly stop: Touch | undefined; // absent: it was not pushed
  readonly slidM: number; // along what stopped it
  readonly slideStop: Touch | undefined; // what it met while it slid
  readonly support: Touch;
}

/** A point of an object, in its own frame (of a model before its scale), and the same in the map [m]. */
export interface Pair {
  readonly inObject: Vec3;
  readonly inWorld: Vec3;
}
export interface Registration {
  readonly rmsMm: number;
  readonly leftOutRmsMm: number;
  readonly errorsMm: readonly number[];
  readonly leftOutErrorsMm: readonly number[];
}

const TIMEOUT = { timeoutMs: 15_000 };
const PIECE_BYTES = 200 * 1024;
const MOST_UNDONE = 50;

const SHAPES: Record<Thing['shape'], SceneShape> = {
  plane: SceneShape.PLANE,
  box: SceneShape.BOX,
  room: SceneShape.ROOM,
  model: SceneShape.MODEL,
};
const MATERIALS: Record<Thing['material'], SceneMaterial> = {
  real: SceneMaterial.REAL,
  virtual: SceneMaterial.VIRTUAL,
  guide: SceneMaterial.GUIDE,
  hidden: SceneMaterial.HIDDEN,
};

const vector = ({ x, y, z }: Vec3) => create(Vector3Schema, { x, y, z });

function toObject(draft: ThingDraft): MessageInitShape<typeof SceneObjectSchema> {
  const { rotation: q, translation } = draft.parentFromObject;
  return {
    ...{ id: draft.id ?? '', name: draft.name, annotationId: draft.annotationId },
    ...(draft.marker && { marker: draft.marker }),
    ...{ shape: SHAPES[draft.shape], material: MATERIALS[draft.material] },
    ...(draft.shape === 'model'
      ? { modelId: draft.modelId, scale: draft.scale }
      : { sizeM: vector(draft.sizeM), colorRgba: draft.colorRgba }),
    parentFromObject: create(Rigid3Schema, {
      rotation: create(QuaternionSchema, { x: q.x, y: q.y, z: q.z, w: q.w }),
      translationM: vector(translation),
    }),
  };
}

const toTouch = (pb: SceneContact | undefined): Touch => ({
  name: pb?.objectName ?? '',
  movedM: pb?.movedM ?? 0,
});

/** What takes a change back: the thing as it was, or that it was not there. */
type Undo = { readonly was: Thing } | { readonly addedId: string };

/** What a person changes of the scene. Throws EditError, in words. */
export class SceneEdits {
  private readonly undos: Undo[] = [];

  constructor(private readonly session: Session) {}

  get undoable(): boolean {
    return this.undos.length > 0;
  }

  /**
   * Lets a thing go where it is, after a push if there is one, of a hand that goes so far; it is added where it
   * has no id.
   */
  async place(draft: ThingDraft, push?: Vec3, handM = 0): Promise<Placed> {
    const { clients } = this.session;
    const was = draft.id === undefined ? undefined : this.session.scene.thing(draft.id);
    const answer = await this.ask((sessionId) =>
      clients.scene.placeObject(
        { sessionId, object: toObject(draft), ...(push && { pushInWorld: vector(push), handM }) },
        TIMEOUT,
      ),
    );
    const { object, stop, support, slidM, slideStop } = answer;
    if (!object) throw new EditError('the server sent no thing back');
    const thing = toThing(object);
    this.session.scene.put(thing);
    this.remember(was ? { was } : { addedId: thing.id });
    return {
      ...{ thing, stop: stop && toTouch(stop), slidM },
      ...{ slideStop: slideStop && toTouch(slideStop), support: toTouch(support) },
    };
  }

  /**
   * Adds a thing, or changes the one of its id; nothing stops it. `further`: part of the change before it, with
   * which it is taken back.
   */
  async put(draft: ThingDraft, further = false): Promise<Thing> {
    const was = draft.id === undefined ? undefined : this.session.scene.thing(draft.id);
    const thing = await this.send(draft);
    if (!further) this.remember(was ? { was } : { addedId: thing.id });
    return thing;
  }

  async remove(id: string): Promise<void> {
    const was = this.session.scene.thing(id);
    await this.drop(id);
    if (was) this.remember({ was });
  }

  /** The last change of this page; what it was about, in words. */
  async undo(): Promise<string> {
    const last = this.undos.pop();
    if (!last) throw new EditError('there is nothing of yours to take back');
    if ('addedId' in last) {
      await this.drop(last.addedId);
      return 'removed again';
    }
    const { was } = last;
    const there = this.session.scene.thing(was.id) !== undefined;
    const { id, ...rest } = was;
    const thing = await this.send(there ? was : rest);
    if (thing.id !== id) this.renumber(id, thing.id);
    return there ? `${was.name} is where it was` : `${was.name} is back`;
  }

  /** A GLB file; the same one again is the same model. */
  async upload(name: string, file: Uint8Array, told: (share: number) => void): Promise<Model> {
    if (file.length === 0) throw new EditError('the file is empty');
    const uploadId = newUuid();
    for (let offset = 0; offset < file.length; offset += PIECE_BYTES) {
      const data = file.slice(offset, offset + PIECE_BYTES);
      const totalBytes = file.length;
      const { receivedBytes, model } = await this.ask((sessionId) =>
        this.session.clients.scene.uploadModel(
          { sessionId, uploadId, name, totalBytes, offsetBytes: offset, data },
          TIMEOUT,
        ),
      );
      told(receivedBytes / totalBytes);
      if (model) return toModel(model);
    }
    throw new EditError('the server did not say what it read');
  }

  /** Where `id` lies by these pairs; it is moved there only with `accept`. */
  async register(
    id: string,
    pairs: readonly Pair[],
    withScale: boolean,
    accept: boolean,
  ): Promise<Registration> {
    const was = this.session.scene.thing(id);
    const correspondences = pairs.map(({ inObject, inWorld }) => ({
      ...{ pointInObjectM: vector(inObject), pointInWorldM: vector(inWorld) },
    }));
    const answer = await this.ask((sessionId) =>
      this.session.clients.scene.registerObject(
        { sessionId, id, correspondences, withScale, accept },
        TIMEOUT,
      ),
    );
    if (accept && was) this.remember({ was });
    const { rmsMm, leftOutRmsMm, errorsMm, leftOutErrorsMm } = answer;
    return { rmsMm, leftOutRmsMm, errorsMm, leftOutErrorsMm };
  }

  private async send(draft: ThingDraft): Promise<Thing> {
    const { object } = await this.ask((sessionId) =>
      this.session.clients.scene.putObject({ sessionId, object: toObject(draft) }, TIMEOUT),
    );
    if (!object) throw new EditError('the server sent no thing back');
    const thing = toThing(object);
    this.session.scene.put(thing);
    return thing;
  }

  private async drop(id: string): Promise<void> {
    await this.ask((sessionId) =>
      this.session.clients.scene.removeObject({ sessionId, id }, TIMEOUT),
    );
    this.session.scene.remove(id);
  }

  private remember(undo: Undo): void {
    this.undos.push(undo);
    if (this.undos.length > MOST_UNDONE) this.undos.shift();
  }

  /** A thing that came back has another id: earlier changes of it mean that one. */
  private renumber(old: string, id: string): void {
    this.undos.forEach((undo, i) => {
      if ('addedId' in undo && undo.addedId === old) this.undos[i] = { addedId: id };
      if ('was' in undo && undo.was.id === old) this.undos[i] = { was: { ...undo.was, id } };
    });
  }

  private async ask<Answer>(call: (sessionId: string) => Promise<Answer>): Promise<Answer> {
    if (!this.session.live) throw new EditError('no connection to the server');
    try {
      return await call(this.session.sessionId);
    } catch (error) {
      throw new EditError(plainWords(error));
    }
  }
}
