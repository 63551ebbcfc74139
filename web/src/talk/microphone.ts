import { pageNowMs } from '../session/clock';
import captureUrl from './capture_worklet?worker&url';
import type { CapturedFrame } from './capture_worklet';
import { FRAME_MS } from './frames';

/** 20 ms of the microphone, and when the first of it was spoken: pageNowMs(). */
export type OnFrame = (samples: Float32Array<ArrayBuffer>, capturedMs: number) => void;

const WANTED: MediaTrackConstraints = {
  echoCancellation: true,
  noiseSuppression: true,
  autoGainControl: true,
  channelCount: 1,
};

/** An open microphone. Its samples are those of the audio clock, and told on the page's. */
export class Microphone {
  private offsetMs = Infinity; // page clock - audio clock, at the quickest that was seen

  private constructor(
    private readonly stream: MediaStream,
    private readonly source: MediaStreamAudioSourceNode,
    private readonly node: AudioWorkletNode,
    private readonly onFrame: OnFrame,
  ) {
    node.port.onmessage = ({ data }: MessageEvent<CapturedFrame>) => this.receive(data);
  }

  /** Rejects as getUserMedia does; microphoneWords says it in words. */
  static async open(context: AudioContext, onFrame: OnFrame): Promise<Microphone> {
    const [stream] = await Promise.all([
      navigator.mediaDevices.getUserMedia({ audio: WANTED }),
      context.audioWorklet.addModule(captureUrl),
    ]);
    const source = context.createMediaStreamSource(stream);
    const node = new AudioWorkletNode(context, 'saccade-capture', {
      numberOfInputs: 1,
      numberOfOutputs: 0,
    });
    source.connect(node);
    return new Microphone(stream, source, node, onFrame);
  }

  private receive({ samples, endS }: CapturedFrame): void {
    this.offsetMs = Math.min(this.offsetMs + 0.01, pageNowMs() - 1000 * endS); // clocks drift
    this.onFrame(samples, 1000 * endS + this.offsetMs - FRAME_MS);
  }

  close(): void {
    this.source.disconnect();
    this.node.port.close();
    for (const track of this.stream.getTracks()) track.stop();
  }
}

/** Why nobody hears this page before it has asked, with the remedy; undefined: it can be tried. */
export function whyNoVoice(): string | undefined {
  if (!window.isSecureContext) {
    return `Browsers give a microphone only to localhost or over https, and this page came from ${location.origin}: open it over https.`;
  }
  if (typeof AudioEncoder === 'undefined') {
    return 'This browser cannot code voice (it has no AudioEncoder), so you are not heard: use Chrome or Edge 94, Firefox 130, Safari 26, or later.';
  }
  return undefined;
}

/** What getUserMedia said, with where to change it. */
export function microphoneWords(error: unknown): string {
  const name = error instanceof DOMException ? error.name : '';
  switch (name) {
    case 'NotAllowedError':
      return 'This page may not use the microphone: allow it at the sign left of the address, then join again.';
    case 'NotFoundError':
      return 'No microphone was found: plug one in, then join again.';
    case 'NotReadableError':
      return 'The microphone cannot be opened: another program may have it. Close that, then join again.';
    default:
      return `No microphone: ${error instanceof Error ? error.message : String(error)}`;
  }
}
