import type { AccessUnit } from '../gen/saccade/v1/video_pb';
import { Decoder } from '../decode/decoder';
import { pageNowMs } from '../session/clock';
import { RateMeter } from '../session/latency';
import type { PictureSink } from '../session/picture_sink';
import type { Session } from '../session/session';
import type { FrameFacts } from '../session/types';
import { Darkness } from './darkness';

export interface Shown {
  readonly facts: FrameFacts;
  readonly decodedMs: number;
  readonly drawnMs: number;
}

/** Decoded pictures onto a canvas, the newest at each screen frame, with what belongs to them. */
export class Player implements PictureSink {
  readonly canvas = document.createElement('canvas');
  readonly rate = new RateMeter();
  readonly darkness = new Darkness();
  /** The frame on the canvas. */
  shown: Shown | undefined;
  private readonly decoder: Decoder;
  private session: Session | undefined;
  private next: { frame: VideoFrame; decodedMs: number } | undefined;
  private readonly context: CanvasRenderingContext2D | null;

  constructor() {
    this.canvas.className = 'picture';
    this.context = this.canvas.getContext('2d', { alpha: false });
    this.decoder = new Decoder({
      picture: (frame, decodedMs) => {
        this.next?.frame.close(); // never shown: a newer one came before the screen's next frame
        this.next = { frame, decodedMs };
        this.session?.decoded(); // not by a timer: in the background those run once a minute
      },
      keyFrameNeeded: () => this.session?.requestKeyFrame(),
    });
  }

  attach(session: Session): void {
    this.session = session;
  }

  /** Why there is no video, in words; undefined if there can be. */
  get unsupported(): string | undefined {
    return this.decoder.unsupported;
  }

  get behind(): boolean {
    return this.decoder.behind;
  }

  decode(facts: FrameFacts, unit: AccessUnit): void {
    this.decoder.decode(facts.frameId, unit.keyFrame, unit.data);
  }

  reset(): void {
    this.decoder.reset();
  }

  /** Draws the newest picture; true if there was a new one. */
  draw(): boolean {
    const { next, context } = this;
    if (this.session?.talk.pause) {
      this.clear();
      return false;
    }
    if (!next || !context) return false;
    this.next = undefined;
    const facts = this.session?.frames.get(next.frame.timestamp);
    if (!facts) {
      next.frame.close(); // of a subscription that is over: its pose is not known any more
      return false;
    }
    const { displayWidth: width, displayHeight: height } = next.frame;
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    context.drawImage(next.frame, 0, 0, width, height);
    const drawnMs = pageNowMs();
    this.darkness.look(next.frame, drawnMs);
    next.frame.close();
    this.shown = { facts, decodedMs: next.decodedMs, drawnMs };
    this.canvas.dataset['frameId'] = String(facts.frameId);
    this.rate.add(drawnMs);
    return true;
  }

  /** Nothing of what was shown stays on the canvas. */
  private clear(): void {
    const { next, shown, canvas } = this;
    next?.frame.close();
    this.next = undefined;
    if (!shown) return;
    this.shown = undefined;
    this.context?.clearRect(0, 0, canvas.width, canvas.height);
    canvas.dataset['frameId'] = '';
  }
}
