import type { Heard, ToPlay } from './play_worklet';
import playUrl from './play_worklet?worker&url';
import { VoiceDecoder } from './voice_coder';

/** One packet of somebody who speaks. */
export interface SpokenPacket {
  readonly speaker: string;
  readonly sequence: number;
  readonly opus: Uint8Array;
  readonly arrivedMs: number;
}

const MOST_SPEAKERS = 32;

/** Plays everybody's voice: decoded here, put in order and mixed in the audio thread. */
export class VoicePlayer {
  private readonly decoders = new Map<string, VoiceDecoder>();

  private constructor(
    private readonly node: AudioWorkletNode,
    onHeard: (heard: Heard) => void,
  ) {
    node.port.onmessage = ({ data }: MessageEvent<Heard>) => onHeard(data);
  }

  static async open(context: AudioContext, onHeard: (heard: Heard) => void): Promise<VoicePlayer> {
    await context.audioWorklet.addModule(playUrl);
    const node = new AudioWorkletNode(context, 'saccade-play', {
      numberOfInputs: 0,
      outputChannelCount: [1],
    });
    node.connect(context.destination);
    return new VoicePlayer(node, onHeard);
  }

  play({ speaker, sequence, opus, arrivedMs }: SpokenPacket): void {
    let decoder = this.decoders.get(speaker);
    if (!decoder) {
      if (this.decoders.size >= MOST_SPEAKERS) this.forgetOne();
      decoder = new VoiceDecoder((number, samples, arrived) => {
        const frame: ToPlay = { speaker, sequence: number, samples, arrivedMs: arrived };
        this.node.port.postMessage(frame, [samples.buffer]);
      });
      this.decoders.set(speaker, decoder);
    }
    decoder.decode(sequence, opus, arrivedMs);
  }

  private forgetOne(): void {
    for (const [name, decoder] of this.decoders) {
      decoder.close();
      this.decoders.delete(name);
      return;
    }
  }

  close(): void {
    this.node.disconnect();
    this.node.port.close();
    for (const decoder of this.decoders.values()) decoder.close();
    this.decoders.clear();
  }
}
