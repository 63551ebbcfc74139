import { WearerCodec } from '../gen/saccade/v1/wearer_pb';
import type { Size } from './turn';

/** A coded picture; `timestamp` is that of the frame it was made of. */
export interface Coded {
  readonly timestamp: number;
  readonly keyFrame: boolean;
  readonly codec: WearerCodec;
  readonly size: Size;
  readonly data: Uint8Array<ArrayBuffer>;
}

interface Choice {
  readonly codec: WearerCodec;
  readonly words: string;
  readonly config: Omit<VideoEncoderConfig, 'width' | 'height' | 'bitrate' | 'framerate'>;
}

const H264 = (acceleration: HardwareAcceleration): Choice => ({
  codec: WearerCodec.H264,
  words: 'H.264',
  config: {
    codec: 'avc1.42e01f', // constrained baseline, up to 1280x720: no B pictures, so no delay
    avc: { format: 'annexb' },
    latencyMode: 'realtime',
    hardwareAcceleration: acceleration,
  },
});
const VP8 = (acceleration: HardwareAcceleration): Choice => ({
  codec: WearerCodec.VP8,
  words: 'VP8',
  config: { codec: 'vp8', latencyMode: 'realtime', hardwareAcceleration: acceleration },
});

/** Best first: what the phone has in hardware, then what it has. */
export const CHOICES: readonly Choice[] = [
  H264('prefer-hardware'),
  VP8('prefer-hardware'),
  H264('no-preference'),
  VP8('no-preference'),
];

type Supports = (config: VideoEncoderConfig) => Promise<boolean>;

const browserSupports: Supports = async (config) => {
  const { supported } = await VideoEncoder.isConfigSupported(config);
  return supported === true;
};

/** The first that this browser codes; undefined: none. */
export async function chooseCodec(
  size: Size,
  supports: Supports = browserSupports,
): Promise<Choice | undefined> {
  for (const choice of CHOICES) {
    const config = { ...choice.config, ...size, bitrate: 2_000_000, framerate: 30 };
    if (await supports(config).catch(() => false)) return choice;
  }
  return undefined;
}

/** A VideoEncoder that is made anew when it fails, or when the size changes. */
export class Coder {
  private encoder: VideoEncoder | undefined;
  private size: Size = { width: 0, height: 0 };
  private keyWanted = true;

  constructor(
    readonly choice: Choice,
    private bitRate: number,
    private readonly fps: number,
    private readonly sink: (coded: Coded) => void,
    private readonly failed: (why: string) => void,
  ) {}

  /** Pictures that it has not done. */
  get waiting(): number {
    return this.encoder?.encodeQueueSize ?? 0;
  }

  requestKeyFrame(): void {
    this.keyWanted = true;
  }

  setBitRate(bitRate: number): void {
    this.bitRate = bitRate;
    if (this.encoder?.state === 'configured') this.encoder.configure(this.config());
  }

  encode(frame: VideoFrame): void {
    const { displayWidth: width, displayHeight: height } = frame;
    if (!this.encoder || this.size.width !== width || this.size.height !== height) {
      this.close();
      this.size = { width, height };
      this.encoder = this.make();
      this.keyWanted = true;
    }
    this.encoder.encode(frame, { keyFrame: this.keyWanted });
    this.keyWanted = false;
  }

  close(): void {
    if (this.encoder && this.encoder.state !== 'closed') this.encoder.close();
    this.encoder = undefined;
  }

  private config(): VideoEncoderConfig {
    return { ...this.choice.config, ...this.size, bitrate: this.bitRate, framerate: this.fps };
  }

  private make(): VideoEncoder {
    const { size } = this;
    const encoder = new VideoEncoder({
      output: (chunk) => {
        const data = new Uint8Array(chunk.byteLength);
        chunk.copyTo(data);
        const keyFrame = chunk.type === 'key';
        const { codec } = this.choice;
        this.sink({ timestamp: chunk.timestamp, keyFrame, codec, size, data });
      },
      error: (error) => {
        if (this.encoder === encoder) this.encoder = undefined; // the next picture makes another
        this.failed(error.message);
      },
    });
    encoder.configure(this.config());
    return encoder;
  }
}
