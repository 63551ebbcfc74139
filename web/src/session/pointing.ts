import { create } from '@bufbuild/protobuf';
import { AnnotationTargetSchema } from '../gen/saccade/v1/annotation_pb';
import { PointerKind } from '../gen/saccade/v1/pointer_pb';
import { toTarget } from './targets';
import type { Session } from './session';
import type { Target } from './types';
import { trace } from './trace';
import { newUuid } from './uuid';

const CALL_MS = 1000 / 60; // pointer.proto: at most 60 calls a second
const AWAKE_MS = 400; // a pointer that is silent for a second is gone
const MOST_POINTS = 64; // pointer.proto
// A stroke's points have to arrive in their order, so one call waits for the other; of a laser the newest
// counts, and a few calls on their way hide a long one.
const IN_FLIGHT = { laser: 3, sketch: 1 } as const;

/** One press of the laser, or one stroke while it is drawn: sends what is new, to whoever else is there. */
export class Pointing {
  private readonly strokeId = newUuid();
  private waiting: Target[] = [];
  private inFlight = 0;
  private sentMs = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private ended = false;
  private last: Target | undefined;
  private readonly awake: ReturnType<typeof setInterval>;

  /** `failed` hears why the others do not see it. */
  constructor(
    private readonly session: Session,
    private readonly kind: 'laser' | 'sketch',
    private readonly colorRgba: number,
    private readonly failed: (error: unknown) => void,
  ) {
    this.awake = setInterval(() => this.stayAwake(), AWAKE_MS);
  }

  add(target: Target): void {
    if (this.ended) return;
    if (this.kind === 'laser') this.waiting = [target];
    else this.waiting.push(target);
    this.last = target;
    this.pump();
  }

  /** It is gone for everybody. */
  end(): void {
    if (this.ended) return;
    this.ended = true;
    clearInterval(this.awake);
    this.pump();
  }

  private stayAwake(): void {
    if (performance.now() - this.sentMs < AWAKE_MS || this.inFlight > 0) return;
    if (!this.last) return;
    this.waiting = [this.last];
    void this.send();
  }

  private pump(): void {
    if (this.timer !== undefined || this.inFlight >= IN_FLIGHT[this.kind]) return;
    const wait = this.sentMs + CALL_MS - performance.now();
    if (wait <= 0) return void this.send();
    this.timer = setTimeout(() => {
      this.timer = undefined;
      void this.send();
    }, Math.ceil(wait));
  }

  private async send(): Promise<void> {
    const { session, kind, strokeId, colorRgba } = this;
    const some = this.waiting.splice(0, MOST_POINTS);
    const released = this.ended && this.waiting.length === 0;
    this.sentMs = performance.now();
    ++this.inFlight;
    trace('saccade.pointer.sent', { kind, released });
    try {
      await session.clients.pointers.point(
        {
          sessionId: session.sessionId,
          kind: kind === 'laser' ? PointerKind.LASER : PointerKind.SKETCH,
          ...{ strokeId, colorRgba, released },
          points: some.map((target) => create(AnnotationTargetSchema, toTarget(target))),
        },
        { timeoutMs: 3000 },
      );
    } catch (error) {
      this.failed(error);
    } finally {
      --this.inFlight;
    }
    if (this.waiting.length > 0 || (this.ended && !released && this.inFlight === 0)) this.pump();
  }
}
