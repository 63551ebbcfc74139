const ACROSS = 16; // blocks
const DOWN = 12;
const BLACK = 8; // of 255: noise of a covered lens stays below
const VIDEO_BLACK = 16; // where levels go from 16 to 235
const VIDEO_SPAN = 219;
const EVERY_MS = 500;

/** One channel of a picture: `step` bytes from pixel to pixel, `stride` from row to row. */
export interface Channel {
  readonly bytes: Uint8Array;
  readonly offset: number;
  readonly stride: number;
  readonly step: number;
  readonly width: number;
  readonly height: number;
}

/** True if no block of the picture shows anything: no light came through the lens. Levels 0 to 255, or as video has them. */
export function isBlack(channel: Channel, fullRange: boolean): boolean {
  const most = fullRange ? BLACK : VIDEO_BLACK + (BLACK * VIDEO_SPAN) / 255;
  for (let i = 0; i < ACROSS * DOWN; ++i) {
    if (meanOf(channel, i % ACROSS, Math.floor(i / ACROSS)) >= most) return false;
  }
  return true;
}

function meanOf(
  { bytes, offset, stride, step, width, height }: Channel,
  x: number,
  y: number,
): number {
  const [left, right] = [Math.floor((x * width) / ACROSS), Math.floor(((x + 1) * width) / ACROSS)];
  const [top, bottom] = [Math.floor((y * height) / DOWN), Math.floor(((y + 1) * height) / DOWN)];
  let sum = 0;
  for (let row = top; row < bottom; ++row) {
    for (let column = left; column < right; ++column) {
      sum += bytes[offset + row * stride + column * step] ?? 0;
    }
  }
  return sum / Math.max((right - left) * (bottom - top), 1);
}

/** Its luma, or its green; undefined where this browser does not give the bytes. */
async function channelOf(frame: VideoFrame): Promise<Channel | undefined> {
  const { format, visibleRect } = frame;
  if (!format || !visibleRect) return undefined;
  const bytes = new Uint8Array(frame.allocationSize());
  const [plane] = await frame.copyTo(bytes);
  if (!plane) return undefined;
  const { width, height } = visibleRect;
  const packed = /^(RGB|BGR)/.test(format);
  const first = plane.offset + (packed ? 1 : 0);
  return { bytes, offset: first, stride: plane.stride, step: packed ? 4 : 1, width, height };
}

/**
 * Looks twice a second whether a picture is black. Its bytes are copied beside the drawing: read back from a
 * canvas they would have the page wait for all that the graphics card has still to draw.
 */
export class Darkness {
  black = false;
  private lookedMs = -Infinity;
  private looking = false;

  look(frame: VideoFrame, nowMs: number): void {
    if (this.looking || nowMs - this.lookedMs < EVERY_MS) return;
    this.lookedMs = nowMs;
    this.looking = true;
    void this.measure(frame.clone());
  }

  private async measure(frame: VideoFrame): Promise<void> {
    try {
      const channel = await channelOf(frame);
      const packed = channel?.step === 4;
      if (channel) this.black = isBlack(channel, packed || frame.colorSpace.fullRange === true);
    } catch {
      this.black = false; // its bytes cannot be had: then nothing is said of it
    } finally {
      frame.close();
      this.looking = false;
    }
  }
}
