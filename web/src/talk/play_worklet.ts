import { loudness } from './frames';
import { JitterBuffer, type JitterCounts } from './jitter_buffer';

/** To the worklet: one frame of one speaker. */
export interface ToPlay {
  readonly speaker: string;
  readonly sequence: number;
  readonly samples: Float32Array;
  readonly arrivedMs: number;
}

/** From it, ten times a second: who is heard, how loud, and what became of their frames. */
export interface Heard {
  readonly speaker: string;
  readonly level: number;
  readonly delayMs: number;
  readonly counts: JitterCounts;
}

const TELL_BLOCKS = 38; // of 128 samples: 0.1 s
const FORGET_TELLS = 600;
const MOST_SPEAKERS = 32;

interface Speaker {
  readonly buffer: JitterBuffer;
  level: number; // loudest since it was told
  silentTells: number;
}

/** Plays all speakers at once, each through a jitter buffer of its own. */
class PlayProcessor extends AudioWorkletProcessor {
  private readonly speakers = new Map<string, Speaker>();
  private block = new Float32Array(128);
  private blocks = 0;

  constructor() {
    super();
    this.port.onmessage = ({ data }: MessageEvent<ToPlay>) => {
      const { speaker, sequence, samples, arrivedMs } = data;
      this.of(speaker)?.buffer.push(sequence, samples, arrivedMs);
    };
  }

  private of(name: string): Speaker | undefined {
    const known = this.speakers.get(name);
    if (known || this.speakers.size >= MOST_SPEAKERS) return known;
    const speaker = { buffer: new JitterBuffer(), level: 0, silentTells: 0 };
    this.speakers.set(name, speaker);
    return speaker;
  }

  override process(_inputs: Float32Array[][], outputs: Float32Array[][]): boolean {
    const out = outputs[0]?.[0];
    if (!out) return true;
    if (this.block.length !== out.length) this.block = new Float32Array(out.length);
    out.fill(0);
    for (const speaker of this.speakers.values()) {
      speaker.buffer.pull(this.block);
      speaker.level = Math.max(speaker.level, loudness(this.block));
      for (let i = 0; i < out.length; ++i) out[i] = (out[i] ?? 0) + (this.block[i] ?? 0);
    }
    for (let i = 0; i < out.length; ++i) out[i] = Math.max(-1, Math.min(1, out[i] ?? 0));
    if (++this.blocks % TELL_BLOCKS === 0) this.tell();
    return true;
  }

  private tell(): void {
    for (const [speaker, one] of this.speakers) {
      const { level, buffer } = one;
      const { delayMs, statistics: counts } = buffer;
      this.port.postMessage({ speaker, level, delayMs, counts } satisfies Heard);
      one.level = 0;
      one.silentTells = buffer.active ? 0 : one.silentTells + 1;
      if (one.silentTells > FORGET_TELLS) this.speakers.delete(speaker);
    }
  }
}

registerProcessor('saccade-play', PlayProcessor);
