import { pictureSize, type Size, swapped, swaps, turnOf, cropOf } from './turn';
import { BitRate, held, type Held } from './back_pressure';
import { type CameraFrame, CameraStream, refusalWords } from './camera';
import { type Coded, Coder, chooseCodec } from './coder';
import { type Sent, SentRing } from './sent';
import type { Uplink } from './socket';

const RING = 40; // pictures: a second and a bit
const MOST_BIT_S = 2_500_000; // at 640 x 480

export type CameraState =
  | { readonly kind: 'off' }
  | { readonly kind: 'opening' }
  | { readonly kind: 'on' }
  | { readonly kind: 'failed'; readonly reason: string };

/** The phone's camera to the server: opened, coded, sent, and opened again when it was taken away. */
export class WearCamera {
  state: CameraState = { kind: 'off' };
  deviceId = '';
  readonly sent = new SentRing(RING);
  readonly held: Record<Held, number> = { encoder: 0, network: 0, server: 0 };
  /** The server's, once it has let us in. */
  taken: Size | undefined;
  fps = 30;
  codecWords = '';
  trackedId = 0; // the newest picture that the server has tracked
  private stream: CameraStream | undefined;
  private coder: Coder | undefined;
  private rate = new BitRate(MOST_BIT_S);
  private heldBefore = 0;
  private sentId = 0;
  private sentMs = 0;
  private takenMs = 0; // when the last one that was coded was captured
  private readonly onTheWay = new Map<number, Sent>(); // in the encoder, by timestamp

  constructor(
    private readonly uplink: () => Uplink | undefined,
    private readonly nowMs: () => number,
    private readonly screenAngle: () => number = () => screen.orientation.angle,
  ) {
    setInterval(() => this.second(), 1000);
  }

  get label(): string {
    return this.stream?.track.label ?? '';
  }

  async start(): Promise<void> {
    if (this.state.kind === 'opening') return;
    this.stream?.stop();
    this.stream = undefined;
    this.state = { kind: 'opening' };
    try {
      const stream = await CameraStream.open(this.deviceId, this.size, this.fps);
      this.stream = stream;
      this.state = { kind: 'on' };
      stream.run(
        (frame) => this.take(frame),
        () => {
          this.state = { kind: 'failed', reason: 'The phone took the camera away (a call?).' };
          void this.resume();
        },
      );
    } catch (error) {
      this.state = { kind: 'failed', reason: refusalWords(error, window.isSecureContext) };
    }
  }

  /** The page is looked at again: the camera may have been taken meanwhile. */
  async resume(): Promise<void> {
    const lost = this.state.kind === 'failed' || this.stream?.track.readyState === 'ended';
    if (lost && this.state.kind !== 'off' && !document.hidden) await this.start();
  }

  requestKeyFrame(): void {
    this.coder?.requestKeyFrame();
  }

  private get size(): Size {
    return this.taken ?? { width: 640, height: 480 };
  }

  private take({ frame, capturedMs }: CameraFrame): void {
    try {
      this.handle(frame, capturedMs);
    } finally {
      frame.close();
    }
  }

  private handle(frame: VideoFrame, capturedMs: number): void {
    const uplink = this.uplink();
    if (!uplink?.live || !this.taken) return;
    // Cameras give what they have: more than is taken is not coded.
    if (capturedMs - this.takenMs < 800 / this.fps) return;
    const why = held(
      {
        encoding: this.coder?.waiting ?? 0,
        bufferedBytes: uplink.bufferedBytes,
        unanswered: this.sentId - this.trackedId,
        sinceSentMs: this.nowMs() - this.sentMs,
      },
      this.rate.now,
    );
    if (why) {
      ++this.held[why];
      return;
    }
    if (!this.coder) {
      void this.makeCoder();
      return;
    }
    this.takenMs = capturedMs;
    const from = pictureSize(frame);
    const turn = turnOf(from, this.screenAngle(), this.taken);
    const upright = swaps(turn) ? swapped(this.taken) : this.taken;
    const sent = this.sent.add(capturedMs, turn, upright);
    const context = sent.picture.getContext('2d', { alpha: false });
    const { x, y, width, height } = cropOf(from, upright);
    context?.drawImage(frame, x, y, width, height, 0, 0, upright.width, upright.height);
    const timestamp = Math.round(capturedMs * 1000);
    const same = from.width === upright.width && from.height === upright.height;
    const picture = same
      ? new VideoFrame(frame, { timestamp })
      : new VideoFrame(sent.picture, { timestamp });
    this.onTheWay.set(timestamp, sent);
    try {
      this.coder.encode(picture);
    } finally {
      picture.close();
    }
  }

  private async makeCoder(): Promise<void> {
    if (this.codecWords !== '') return; // under way
    this.codecWords = 'choosing';
    const choice = await chooseCodec(this.size);
    if (!choice) {
      this.codecWords = ''; // "Start again" chooses again
      this.stream?.stop(); // or each of its pictures would
      this.stream = undefined;
      this.state = {
        kind: 'failed',
        reason:
          'This browser cannot code video (WebCodecs: H.264 or VP8). Use Chrome, or Safari 16.4 or later.',
      };
      return;
    }
    this.codecWords = choice.words;
    this.coder = new Coder(
      choice,
      this.rate.now,
      this.fps,
      (coded) => this.send(coded),
      (why) => console.warn(`encoder: ${why}`),
    );
  }

  private send(coded: Coded): void {
    const sent = this.onTheWay.get(coded.timestamp);
    this.onTheWay.delete(coded.timestamp);
    if (!sent) return;
    if (this.onTheWay.size > RING) this.onTheWay.clear(); // of an encoder that failed
    sent.encodedMs = this.nowMs();
    const { pictureId, capturedMs, turn } = sent;
    if (this.uplink()?.sendPicture(pictureId, capturedMs, coded, turn)) {
      this.sentId = pictureId;
      this.sentMs = sent.encodedMs;
    } else {
      this.coder?.requestKeyFrame(); // the link broke meanwhile: what follows lacks this one
    }
  }

  /** A new link: the server knows no picture of before. */
  linked(taken: Size, fps: number): void {
    this.taken = taken;
    this.fps = fps;
    this.trackedId = this.sentId;
    this.requestKeyFrame();
  }

  private second(): void {
    const { network } = this.held;
    if (this.rate.second(network - this.heldBefore)) this.coder?.setBitRate(this.rate.now);
    this.heldBefore = network;
  }
}
