import type { FromDecoder, ToDecoder } from './messages';

export interface DecoderEvents {
  /** A picture, to be closed by the receiver. Its timestamp is the frame id. */
  picture(frame: VideoFrame, decodedMs: number): void;
  keyFrameNeeded(): void;
}

/** Chunks that may wait in the decoder before the server is asked to hold back. */
const MAX_WAITING = 6;

/** The main thread's end of the decode worker. */
export class Decoder {
  /** Why no video can be shown here; undefined if it can. */
  unsupported: string | undefined;
  private readonly worker: Worker | undefined;
  private waiting = 0;

  constructor(private readonly events: DecoderEvents) {
    this.unsupported = whyNoVideo();
    if (this.unsupported) return;
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = ({ data }: MessageEvent<FromDecoder>) => this.receive(data);
  }

  get behind(): boolean {
    return this.waiting > MAX_WAITING;
  }

  decode(frameId: number, key: boolean, accessUnit: Uint8Array): void {
    if (!this.worker) return;
    ++this.waiting;
    const data = accessUnit.slice(); // its buffer may hold the next messages as well
    this.post({ kind: 'chunk', frameId, key, data }, [data.buffer]);
  }

  reset(): void {
    this.waiting = 0;
    if (this.worker) this.post({ kind: 'reset' });
  }

  private post(message: ToDecoder, transfer: Transferable[] = []): void {
    this.worker?.postMessage(message, transfer);
  }

  private receive(message: FromDecoder): void {
    switch (message.kind) {
      case 'picture':
        this.waiting = Math.max(0, this.waiting - 1);
        this.events.picture(message.frame, message.decodedMs);
        break;
      case 'waiting':
        this.waiting = Math.max(0, this.waiting - 1);
        break;
      case 'key_frame_needed':
        this.waiting = 0;
        this.events.keyFrameNeeded();
        break;
      case 'unsupported':
        this.unsupported = message.reason;
        break;
    }
  }
}

function whyNoVideo(): string | undefined {
  if (typeof VideoDecoder !== 'undefined') return undefined;
  if (!window.isSecureContext) {
    return `Browsers decode video only on localhost or over https. This page came from ${location.origin}: open it on the wearable itself, through an SSH tunnel, or over https.`;
  }
  return 'This browser has no WebCodecs. Use Chrome or Edge 94, Safari 16.4, Firefox 130, or later.';
}
