import { FRAME } from './frames';

/** 20 ms of the microphone. */
export interface CapturedFrame {
  readonly samples: Float32Array<ArrayBuffer>;
  readonly endS: number; // when it was complete, the audio clock
}

/** The microphone in frames of 20 ms. */
class CaptureProcessor extends AudioWorkletProcessor {
  private frame = new Float32Array(FRAME);
  private filled = 0;

  override process(inputs: Float32Array[][]): boolean {
    const input = inputs[0]?.[0];
    if (!input) return true;
    for (const sample of input) {
      this.frame[this.filled++] = sample;
      if (this.filled < FRAME) continue;
      const samples = this.frame;
      this.port.postMessage({ samples, endS: currentTime } satisfies CapturedFrame, [
        samples.buffer,
      ]);
      this.frame = new Float32Array(FRAME);
      this.filled = 0;
    }
    return true;
  }
}

registerProcessor('saccade-capture', CaptureProcessor);
