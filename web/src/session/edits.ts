import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { AnnotationDraftSchema, AnnotationTargetSchema } from '../gen/saccade/v1/annotation_pb';
import { PixelSchema, Vector3Schema } from '../gen/saccade/v1/geometry_pb';
import type { Vec3 } from '../geometry/vec3';
import { isGone, plainWords } from '../transport/errors';
import { pbShapes, toAnnotation } from './convert';
import type { Session } from './session';
import type { Annotation, Shape, Target } from './types';

export interface Placement {
  readonly shape: Shape;
  readonly text: string;
  readonly colorRgba: number;
  readonly target: Target;
  /** Takes its place where the server no longer keeps the frame that `target` names. */
  readonly later?: Target | undefined;
  /** Where this page thinks it will land, shown until the server answers. */
  readonly guessInWorld: Vec3 | undefined;
}

/** A request that failed, in words. */
export class EditError extends Error {}

const TIMEOUT = { timeoutMs: 5000 };

/** What a person can change. Each shows its effect at once and takes it back if it was refused. */
export class Edits {
  constructor(private readonly session: Session) {}

  async place(placement: Placement): Promise<Annotation> {
    const { annotations, clients, sessionId } = this.session;
    const requestId = newUuid();
    annotations.addPending({
      requestId,
      shape: placement.shape,
      text: placement.text,
      pointInWorld: placement.guessInWorld,
      sizeM: 0.05,
      colorRgba: placement.colorRgba,
    });
    try {
      const ask = (target: Target) => {
        const { shape, text, colorRgba } = placement;
        const fields = { shape: pbShapes[shape], text, colorRgba, target: toTarget(target) };
        const draft = create(AnnotationDraftSchema, fields);
        return clients.annotations.create({ requestId, sessionId, draft }, TIMEOUT);
      };
      const reply = await ask(placement.target).catch((error: unknown) => {
        if (placement.later && isGone(error)) return ask(placement.later);
        throw error;
      });
      if (!reply.annotation) throw new EditError('the server sent no annotation back');
      const annotation = toAnnotation(reply.annotation);
      annotations.put(annotation);
      return annotation;
    } catch (error) {
      throw asEditError(error);
    } finally {
      annotations.removePending(requestId);
    }
  }

  setText(id: string, text: string): Promise<void> {
    return this.update(id, { text });
  }

  setColour(id: string, colorRgba: number): Promise<void> {
    return this.update(id, { colorRgba });
  }

  private async update(id: string, what: { text?: string; colorRgba?: number }): Promise<void> {
    const { annotations, clients, sessionId } = this.session;
    try {
      const reply = await clients.annotations.update({ sessionId, id, ...what }, TIMEOUT);
      if (reply.annotation) annotations.put(toAnnotation(reply.annotation));
    } catch (error) {
      throw asEditError(error);
    }
  }

  async remove(id: string): Promise<void> {
    const { annotations, clients, sessionId } = this.session;
    const show = annotations.hide(id);
    try {
      await clients.annotations.delete({ sessionId, id }, TIMEOUT);
    } catch (error) {
      show();
      throw asEditError(error);
    }
  }

  /** What was undone, in the server's words. */
  async undo(): Promise<string> {
    const { clients, sessionId } = this.session;
    try {
      return (await clients.annotations.undo({ sessionId }, TIMEOUT)).description;
    } catch (error) {
      throw asEditError(error);
    }
  }

  async redo(): Promise<string> {
    const { clients, sessionId } = this.session;
    try {
      return (await clients.annotations.redo({ sessionId }, TIMEOUT)).description;
    } catch (error) {
      throw asEditError(error);
    }
  }

  async resetMap(): Promise<void> {
    const { clients, sessionId } = this.session;
    try {
      await clients.map.reset({ sessionId }, TIMEOUT);
    } catch (error) {
      throw asEditError(error);
    }
  }
}

const asEditError = (error: unknown): EditError =>
  error instanceof EditError ? error : new EditError(plainWords(error));

function toTarget(target: Target): MessageInitShape<typeof AnnotationTargetSchema> {
  const vector = (v: Vec3) => create(Vector3Schema, { x: v.x, y: v.y, z: v.z });
  switch (target.kind) {
    case 'pixel':
      return {
        target: {
          case: 'framePixel',
          value: {
            frameId: BigInt(target.frameId),
            pixel: create(PixelSchema, { u: target.pixel.u, v: target.pixel.v }),
          },
        },
      };
    case 'feature':
      return { target: { case: 'featureId', value: BigInt(target.featureId) } };
    case 'point':
      return { target: { case: 'pointInWorldM', value: vector(target.pointInWorld) } };
    case 'ray':
      return {
        target: {
          case: 'ray',
          value: {
            originInWorldM: vector(target.originInWorld),
            directionInWorld: vector(target.directionInWorld),
          },
        },
      };
  }
}

/** RFC 4122, version 4. `crypto.randomUUID` exists only on localhost and https. */
export function newUuid(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = ((bytes[6] ?? 0) & 0x0f) | 0x40;
  bytes[8] = ((bytes[8] ?? 0) & 0x3f) | 0x80;
  const hex = [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  return hex.replace(/^(.{8})(.{4})(.{4})(.{4})(.{12})$/, '$1-$2-$3-$4-$5');
}
