import { type PointerEvent, PointerKind } from '../gen/saccade/v1/pointer_pb';
import type { Vec3 } from '../geometry/vec3';
import { toVec3 } from './convert';
import { trace } from './trace';

/** What somebody else points at or draws right now. */
export interface OthersPointer {
  readonly strokeId: string;
  readonly kind: 'laser' | 'sketch';
  readonly name: string;
  readonly colorRgba: number;
  /** In world [m]; of a laser its newest point alone. */
  readonly points: readonly Vec3[];
  readonly heardMs: number;
}

/** Without a word for so long it is gone, whatever became of its end. */
const SILENT_MS = 1500;

export class PointerBook {
  /** Of each person and kind the last one. One that is over is kept: after a silence it may go on, from there. */
  private readonly known = new Map<string, OthersPointer & { readonly over: boolean }>();
  /** Told at once of what was heard. */
  heard: () => void = () => undefined;

  /** `me`: the participant whose own are not kept, as they are drawn before they are sent. */
  apply({ pointers }: PointerEvent, me: string, nowMs: number): void {
    for (const pb of pointers) {
      if (pb.participantId === me) continue;
      const key = `${pb.participantId} ${pb.kind}`;
      const before = this.known.get(key);
      if (pb.released) {
        if (before?.strokeId === pb.strokeId) this.known.set(key, { ...before, over: true });
        continue;
      }
      const news = pb.pointsInWorldM.map(toVec3);
      const laser = pb.kind === PointerKind.LASER;
      const old = before?.strokeId === pb.strokeId ? before.points : [];
      const newest = news.at(-1) ?? old.at(-1);
      this.known.set(key, {
        strokeId: pb.strokeId,
        kind: laser ? 'laser' : 'sketch',
        name: pb.displayName,
        colorRgba: pb.colorRgba || 0xffffffff,
        points: laser ? (newest ? [newest] : []) : [...old.slice(0, pb.first), ...news],
        heardMs: nowMs,
        over: false,
      });
    }
    trace('saccade.pointer.heard');
    this.heard();
  }

  list(nowMs: number): OthersPointer[] {
    return [...this.known.values()].filter(
      ({ over, heardMs }) => !over && nowMs - heardMs < SILENT_MS,
    );
  }

  clear(): void {
    this.known.clear();
  }
}
