import { FRAME, FRAME_MS, MOST_OPUS_BYTES, SAMPLE_RATE_HZ } from './frames';

const BIT_RATE = 32_000;

/** One coded frame of 20 ms. */
export interface CodedFrame {
  readonly sequence: number;
  readonly opus: Uint8Array<ArrayBuffer>;
}

/** Opus of frames of 20 ms, by WebCodecs. */
export class VoiceCoder {
  private readonly encoder: AudioEncoder;

  constructor(onCoded: (frame: CodedFrame) => void, onProblem: (problem: string) => void) {
    this.encoder = new AudioEncoder({
      output: (chunk) => {
        if (chunk.byteLength > MOST_OPUS_BYTES) return; // far more than is asked for
        const opus = new Uint8Array(chunk.byteLength);
        chunk.copyTo(opus);
        onCoded({ sequence: Math.round(chunk.timestamp / (1000 * FRAME_MS)), opus });
      },
      error: ({ message }) => onProblem(`Voice cannot be coded: ${message}`),
    });
    this.encoder.configure({
      codec: 'opus',
      sampleRate: SAMPLE_RATE_HZ,
      numberOfChannels: 1,
      bitrate: BIT_RATE,
      opus: { frameDuration: 1000 * FRAME_MS },
    });
  }

  code(sequence: number, samples: Float32Array<ArrayBuffer>): void {
    if (this.encoder.state !== 'configured') return;
    const audio = new AudioData({
      format: 'f32-planar',
      sampleRate: SAMPLE_RATE_HZ,
      numberOfFrames: FRAME,
      numberOfChannels: 1,
      timestamp: sequence * 1000 * FRAME_MS,
      data: samples,
    });
    this.encoder.encode(audio);
    audio.close();
  }

  close(): void {
    if (this.encoder.state !== 'closed') this.encoder.close();
  }
}

/** Samples of one speaker's packets, in the order of the packets. */
export class VoiceDecoder {
  private decoder: AudioDecoder | undefined;
  private readonly under: { sequence: number; arrivedMs: number }[] = []; // way

  constructor(
    private readonly onFrame: (sequence: number, samples: Float32Array, arrivedMs: number) => void,
  ) {}

  decode(sequence: number, opus: Uint8Array, arrivedMs: number): void {
    this.decoder ??= this.open();
    this.under.push({ sequence, arrivedMs });
    const timestamp = sequence * 1000 * FRAME_MS;
    this.decoder.decode(new EncodedAudioChunk({ type: 'key', timestamp, data: opus.slice() }));
  }

  private open(): AudioDecoder {
    const decoder = new AudioDecoder({
      output: (audio) => {
        const packet = this.under.shift();
        const samples = new Float32Array(FRAME);
        const frameCount = Math.min(FRAME, audio.numberOfFrames);
        audio.copyTo(samples.subarray(0, frameCount), {
          planeIndex: 0,
          format: 'f32-planar',
          frameCount,
        });
        audio.close();
        if (packet) this.onFrame(packet.sequence, samples, packet.arrivedMs);
      },
      error: () => {
        this.under.length = 0; // of what is no Opus; the next packet opens another one
        this.decoder = undefined;
      },
    });
    decoder.configure({ codec: 'opus', sampleRate: SAMPLE_RATE_HZ, numberOfChannels: 1 });
    return decoder;
  }

  close(): void {
    if (this.decoder && this.decoder.state !== 'closed') this.decoder.close();
    this.decoder = undefined;
  }
}
