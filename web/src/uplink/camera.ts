import type { Size } from './turn';

/** A picture of the camera, upright. Whoever has it closes it. */
export interface CameraFrame {
  readonly frame: VideoFrame;
  readonly capturedMs: number; // this page's clock, performance.timeOrigin + now()
}

export interface Lens {
  readonly deviceId: string;
  readonly label: string;
}

/** Why there is no camera, and what to do. */
export function refusalWords(error: unknown, secure: boolean): string {
  if (!secure) {
    return 'The camera needs https. Open the link as it was sent; do not shorten it to an address.';
  }
  switch (error instanceof DOMException ? error.name : '') {
    case 'NotAllowedError':
      return 'The camera was not allowed. Tap the sign left of the address, allow the camera for this page, then tap Start again. If there is nothing to allow, look in the phone’s settings: Apps, this browser, Permissions.';
    case 'NotFoundError':
    case 'OverconstrainedError':
      return 'There is no such camera. Choose another lens, or use a phone that has one.';
    case 'NotReadableError':
    case 'AbortError':
      return 'Another app has the camera. Close it (a call, the camera app), then tap Start again.';
    default:
      return `The camera cannot be opened: ${error instanceof Error ? error.message : String(error)}`;
  }
}

/** A frame's own time to this page's clock: the least delay to its arrival is taken for none. */
export class FrameTimes {
  private least: number | undefined;

  capturedMs(frameMs: number, nowMs: number): number {
    const delay = nowMs - frameMs;
    // Forgotten slowly, for clocks that drift; a stream that began anew is behind by far.
    const slow = this.least === undefined ? delay : Math.min(this.least + 0.003, delay);
    this.least = delay - slow > 2000 ? delay : slow;
    return frameMs + this.least;
  }
}

const nowMs = (): number => performance.timeOrigin + performance.now();

interface TrackProcessor {
  readonly readable: ReadableStream<VideoFrame>;
}
type TrackProcessorClass = new (init: {
  track: MediaStreamTrack;
  maxBufferSize: number;
}) => TrackProcessor;

/** The phone's camera: frames as they come, the newest alone. */
export class CameraStream {
  private stopped = false;

  private constructor(
    readonly stream: MediaStream,
    readonly track: MediaStreamTrack,
  ) {}

  /** `deviceId` empty: the one that looks away from the face. Rejects as getUserMedia. */
  static async open(deviceId: string, size: Size, fps: number): Promise<CameraStream> {
    const which = deviceId
      ? { deviceId: { exact: deviceId } }
      : { facingMode: { ideal: 'environment' } };
    const long = Math.max(size.width, size.height);
    const short = Math.min(size.width, size.height);
    const stream = await navigator.mediaDevices.getUserMedia({
      video: {
        ...which,
        width: { ideal: long },
        height: { ideal: short },
        frameRate: { ideal: fps },
      },
      audio: false,
    });
    const [track] = stream.getVideoTracks();
    if (!track) throw new DOMException('no video track', 'NotFoundError');
    return new CameraStream(stream, track);
  }

  /** Known once the camera was allowed. */
  static async lenses(): Promise<Lens[]> {
    const devices = await navigator.mediaDevices.enumerateDevices();
    return devices
      .filter(({ kind }) => kind === 'videoinput')
      .map(({ deviceId, label }, i) => ({ deviceId, label: label || `camera ${i + 1}` }));
  }

  /** Gives frames to `sink` until it is stopped; `ended` if the phone takes the camera away. */
  run(sink: (frame: CameraFrame) => void, ended: () => void): void {
    this.track.addEventListener('ended', () => {
      if (!this.stopped) ended();
    });
    const { MediaStreamTrackProcessor } = window as unknown as {
      MediaStreamTrackProcessor?: TrackProcessorClass;
    };
    if (MediaStreamTrackProcessor) {
      const init = { track: this.track, maxBufferSize: 1 };
      void this.read(new MediaStreamTrackProcessor(init).readable.getReader(), sink);
    } else {
      this.watch(sink);
    }
  }

  stop(): void {
    this.stopped = true;
    this.track.stop();
  }

  private async read(
    reader: ReadableStreamDefaultReader<VideoFrame>,
    sink: (frame: CameraFrame) => void,
  ): Promise<void> {
    const times = new FrameTimes();
    for (;;) {
      const { done, value: frame } = await reader.read();
      if (done) return;
      if (this.stopped) {
        frame.close();
        continue; // until the track's end
      }
      sink({ frame, capturedMs: times.capturedMs(frame.timestamp / 1000, nowMs()) });
    }
  }

  /** Where frames come by way of a video element. */
  private watch(sink: (frame: CameraFrame) => void): void {
    const video = document.createElement('video');
    video.muted = true;
    video.playsInline = true;
    video.srcObject = this.stream;
    void video.play();
    const next = (now: number, { captureTime }: VideoFrameCallbackMetadata): void => {
      if (this.stopped) return;
      const capturedMs = performance.timeOrigin + (captureTime ?? now);
      sink({
        frame: new VideoFrame(video, { timestamp: Math.round(capturedMs * 1000) }),
        capturedMs,
      });
      video.requestVideoFrameCallback(next);
    };
    video.requestVideoFrameCallback(next);
  }
}
