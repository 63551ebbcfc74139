import { create } from '@bufbuild/protobuf';
import { AnnotationDraftSchema } from '../gen/saccade/v1/annotation_pb';
import { PixelSchema, QuaternionSchema } from '../gen/saccade/v1/geometry_pb';
import type { Quaternion } from '../geometry/rigid3';
import type { Pixel, Vec3 } from '../geometry/vec3';
import { isGone, plainWords } from '../transport/errors';
import { pbShapes, toAnnotation } from './annotation_convert';
import type { Session } from './session';
import { toTarget, toVector } from './targets';
import type { Annotation, MarkForm, Shape, Target } from './types';
import { newUuid } from './uuid';

/** Where a click is meant to land, and what is shown until the server has answered. */
export interface Site {
  readonly target: Target;
  /** Takes its place where the server no longer keeps the frame that `target` names. */
  readonly later?: Target | undefined;
  /** Where this page thinks it will land, shown until the server answers. */
  readonly guessInWorld: Vec3 | undefined;
}

export interface Placement extends Site {
  readonly shape: Shape;
  readonly text: string;
  readonly colorRgba: number;
  readonly sizeM?: number;
  readonly worldFromMark?: Quaternion | undefined;
  readonly extentM?: Vec3 | undefined;
  /** MEASURE: its other end. */
  readonly end?: Site;
  /** INK: in the frame that `target` names; else the offsets count. */
  readonly inkPx?: readonly Pixel[];
  /** INK: the stroke; MEASURE: its other end; from the anchor. */
  readonly inkOffsetsM?: readonly Vec3[];
  /** PICTURE: PNG or JPEG. */
  readonly picture?: {
    readonly bytes: Uint8Array;
    readonly width: number;
    readonly height: number;
  };
  readonly checkItems?: readonly string[];
  /** Edits with the same one are undone together. */
  readonly editGroup?: string | undefined;
}

/** What changes of a mark; absent: stays. */
export interface Change {
  readonly text?: string;
  readonly colorRgba?: number;
  readonly locked?: boolean;
  readonly place?: Site;
  readonly end?: Site;
  readonly worldFromMark?: Quaternion;
}

/** A request that failed, in words. */
export class EditError extends Error {}

const TIMEOUT = { timeoutMs: 5000 };
const UPLOAD_TIMEOUT = { timeoutMs: 30_000 };

export const DEFAULT_SIZE_M = 0.05; // annotation.proto

const toQuaternion = (q: Quaternion) =>
  create(QuaternionSchema, { x: q.x, y: q.y, z: q.z, w: q.w });

/** What a person can change. Each shows its effect at once and takes it back if it was refused. */
export class Edits {
  constructor(private readonly session: Session) {}

  async place(placement: Placement): Promise<Annotation> {
    const { annotations } = this.session;
    const requestId = newUuid();
    annotations.addPending({ requestId, ...pendingOf(placement) });
    try {
      const annotation = await this.create(requestId, placement);
      annotations.put(annotation);
      return annotation;
    } catch (error) {
      throw asEditError(error);
    } finally {
      annotations.removePending(requestId);
    }
  }

  private async create(requestId: string, placement: Placement): Promise<Annotation> {
    const { clients, sessionId } = this.session;
    const options = placement.picture ? UPLOAD_TIMEOUT : TIMEOUT;
    const ask = (late: boolean) =>
      clients.annotations.create(
        {
          ...{ requestId, sessionId, draft: draftOf(placement, late) },
          editGroup: placement.editGroup ?? '',
        },
        options,
      );
    const reply = await ask(false).catch((error: unknown) => {
      if ((placement.later ?? placement.end?.later) && isGone(error)) return ask(true);
      throw error;
    });
    if (!reply.annotation) throw new EditError('the server sent no annotation back');
    return toAnnotation(reply.annotation);
  }

  /** `editGroup`: changes with the same one are undone together. */
  async change(id: string, change: Change, editGroup = ''): Promise<void> {
    const { annotations, clients, sessionId } = this.session;
    const { place, end, worldFromMark, ...plain } = change;
    const ask = (late: boolean) =>
      clients.annotations.update(
        {
          ...{ sessionId, id, editGroup, ...plain },
          ...(place && { target: toTarget(chosen(place, late)) }),
          ...(end && { endTarget: toTarget(chosen(end, late)) }),
          ...(worldFromMark && { worldFromMark: toQuaternion(worldFromMark) }),
        },
        TIMEOUT,
      );
    try {
      const reply = await ask(false).catch((error: unknown) => {
        if ((place?.later ?? end?.later) && isGone(error)) return ask(true);
        throw error;
      });
      if (reply.annotation) annotations.put(toAnnotation(reply.annotation));
    } catch (error) {
      throw asEditError(error);
    }
  }

  async remove(id: string, editGroup = ''): Promise<void> {
    const { annotations, clients, sessionId } = this.session;
    const show = annotations.hide(id);
    try {
      await clients.annotations.delete({ sessionId, id, editGroup }, TIMEOUT);
    } catch (error) {
      show();
      throw asEditError(error);
    }
  }

  /** Ticks a line of a check list off, or on again. */
  async tick(id: string, index: number, done: boolean): Promise<void> {
    const { annotations, clients, sessionId } = this.session;
    try {
      const request = { sessionId, id, index, done };
      const reply = await clients.annotations.tickCheckItem(request, TIMEOUT);
      if (reply.annotation) annotations.put(toAnnotation(reply.annotation));
    } catch (error) {
      throw asEditError(error);
    }
  }

  /** The bytes of a picture, PNG or JPEG. */
  async picture(id: string): Promise<Uint8Array<ArrayBuffer>> {
    const { clients, sessionId } = this.session;
    try {
      const reply = await clients.annotations.getPicture({ sessionId, id }, UPLOAD_TIMEOUT);
      return new Uint8Array(reply.picture);
    } catch (error) {
      throw asEditError(error);
    }
  }

  /** What was undone, in the server's words. */
  undo(): Promise<string> {
    return this.step('undo');
  }

  redo(): Promise<string> {
    return this.step('redo');
  }

  private async step(which: 'undo' | 'redo'): Promise<string> {
    const { clients, sessionId } = this.session;
    try {
      return (await clients.annotations[which]({ sessionId }, TIMEOUT)).description;
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

const chosen = ({ target, later }: Site, late: boolean): Target =>
  late ? (later ?? target) : target;

/** As it is drawn until the server has answered. */
function pendingOf(placement: Placement): MarkForm & { pointInWorld: Vec3 | undefined } {
  const { guessInWorld, picture, checkItems = [], inkOffsetsM = [] } = placement;
  return {
    ...{ shape: placement.shape, text: placement.text, colorRgba: placement.colorRgba },
    ...{ sizeM: placement.sizeM ?? DEFAULT_SIZE_M, pointInWorld: guessInWorld, inkOffsetsM },
    ...{ worldFromMark: placement.worldFromMark, extentM: placement.extentM },
    ...{ number: 0, lengthM: 0, lengthSigmaM: 0 },
    picture: picture && { sha256: '', width: picture.width, height: picture.height },
    checkItems: checkItems.map((text) => ({ text, done: false, doneBy: '' })),
  };
}

function draftOf(placement: Placement, late: boolean) {
  const { shape, inkPx = [], inkOffsetsM = [], end, worldFromMark, extentM } = placement;
  const target = chosen(placement, late);
  const byPixels = inkPx.length > 0 && target.kind === 'pixel';
  const byOffsets = !byPixels && (shape === 'ink' || (shape === 'measure' && !end));
  return create(AnnotationDraftSchema, {
    ...{ shape: pbShapes[shape], text: placement.text, colorRgba: placement.colorRgba },
    ...{ sizeM: placement.sizeM ?? 0, target: toTarget(target) },
    inkPx: byPixels ? inkPx.map(({ u, v }) => create(PixelSchema, { u, v })) : [],
    inkOffsetM: byOffsets ? inkOffsetsM.map(toVector) : [],
    ...(end && { endTarget: toTarget(chosen(end, late)) }),
    ...(worldFromMark && { worldFromMark: toQuaternion(worldFromMark) }),
    ...(extentM && { extentM: toVector(extentM) }),
    picture: placement.picture?.bytes ?? new Uint8Array(),
    checkItems: [...(placement.checkItems ?? [])],
  });
}
