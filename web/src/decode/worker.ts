import { codecOf } from './h264';
import type { FromDecoder, ToDecoder } from './messages';

/*
 * Decodes off the main thread. A chunk's timestamp is its frame id, and so is the picture's: which
 * pose belongs to a picture is never a guess.
 */
let decoder: VideoDecoder | undefined;
let codec: string | undefined;
let waitingForKey = true;

const post = (message: FromDecoder, transfer: Transferable[] = []): void =>
  self.postMessage(message, { transfer });

const nowMs = (): number => performance.timeOrigin + performance.now();

function failed(reason: string): void {
  if (decoder && decoder.state !== 'closed') decoder.close();
  decoder = undefined;
  codec = undefined;
  waitingForKey = true;
  post({ kind: 'key_frame_needed', reason });
}

function configure(wanted: string): VideoDecoder {
  const made = new VideoDecoder({
    output: (frame) => post({ kind: 'picture', frame, decodedMs: nowMs() }, [frame]),
    error: (error) => {
      if (error.name === 'NotSupportedError') {
        post({ kind: 'unsupported', reason: `this browser does not decode H.264 (${wanted})` });
      }
      if (made === decoder) failed(error.message);
    },
  });
  made.configure({ codec: wanted, optimizeForLatency: true });
  return made;
}

function decode(frameId: number, key: boolean, data: Uint8Array): void {
  if (waitingForKey && !key) return post({ kind: 'waiting' });
  try {
    const wanted = key ? codecOf(data) : codec;
    if (!wanted) return failed('key frame without parameters');
    if (!decoder || wanted !== codec) {
      if (decoder && decoder.state !== 'closed') decoder.close();
      codec = wanted;
      decoder = configure(wanted);
    }
    waitingForKey = false;
    decoder.decode(
      new EncodedVideoChunk({ type: key ? 'key' : 'delta', timestamp: frameId, data }),
    );
  } catch (error) {
    failed(error instanceof Error ? error.message : String(error));
  }
}

self.addEventListener('message', ({ data: message }: MessageEvent<ToDecoder>) => {
  if (message.kind === 'chunk') {
    decode(message.frameId, message.key, message.data);
  } else {
    waitingForKey = true;
    if (decoder && decoder.state !== 'closed') decoder.reset();
    decoder = undefined;
    codec = undefined;
  }
});
