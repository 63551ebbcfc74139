import { FRAME, FRAME_MS } from './frames';

const LEAST_MS = 20;
const MOST_MS = 240;
const REMEMBERED = 150; // arrivals, 3 s
const SHARE = 0.97; // of them that are to be there in time
const MARGIN_MS = 10;
const FADE = 240; // samples, 5 ms: no click where something is missing
const RESTART_FRAMES = 3; // of nothing: the next one begins anew
const PAUSE_FRAMES = 5; // not sent: a silence of the speaker's, not a loss
const ANOTHER_FRAMES = 250; // so far back is no late one
const CALM_FRAMES = 50; // 1 s with more than is needed, before a frame is left out

/** What became of the frames, for whoever measures. */
export interface JitterCounts {
  readonly played: number;
  readonly concealed: number; // frames that were not there when their time came, of those spoken
  readonly late: number; // came after their time
  readonly skipped: number; // left out to catch up
}

/**
 * One speaker's frames between the network and the ear: in order, evenly, as late as the network is
 * uneven and no later. What is missing fades out and in again. Pure; runs in the audio thread.
 */
export class JitterBuffer {
  private readonly frames = new Map<number, Float32Array>();
  private readonly transits: number[] = []; // arrival - sequence, of the last ones [ms]
  private next = -1; // sequence to be played; -1: waits to begin
  private offset = 0; // samples of it that were played
  private current: Float32Array | undefined; // undefined: silence, or the last one fading
  private last: Float32Array = new Float32Array(FRAME); // the last one that was there
  private missing = 0; // frames in a row that were not
  private surplus = 0; // frames in a row with more waiting than is needed
  private counts = { played: 0, concealed: 0, late: 0, skipped: 0 };
  private targetMs = 40;

  get statistics(): JitterCounts {
    return { ...this.counts };
  }

  /** How much is to wait before it is played [ms]. */
  get delayMs(): number {
    return this.targetMs;
  }

  /** True while something is heard. */
  get active(): boolean {
    return this.next >= 0;
  }

  push(sequence: number, samples: Float32Array, arrivedMs: number): void {
    this.learn(arrivedMs - sequence * FRAME_MS);
    if (this.next - sequence > ANOTHER_FRAMES) this.restart(); // numbers of another page's
    if (this.next >= 0 && sequence < this.next) {
      ++this.counts.late;
      return;
    }
    this.frames.set(sequence, samples);
    if (this.next < 0) this.forgetBefore(sequence - MOST_MS / FRAME_MS); // the end of what was before
    // A speaker's stream is bounded whatever he sends.
    while (this.frames.size > (2 * MOST_MS) / FRAME_MS) this.frames.delete(this.oldest);
  }

  /** Fills `out` with what is to be heard now. */
  pull(out: Float32Array): void {
    for (let at = 0; at < out.length; ) {
      if (this.offset === 0 && !this.begin()) {
        out.fill(0, at);
        return;
      }
      const count = Math.min(out.length - at, FRAME - this.offset);
      this.copy(out, at, count);
      at += count;
      this.offset = (this.offset + count) % FRAME;
    }
  }

  private restart(): void {
    this.frames.clear();
    this.transits.length = 0;
    this.next = -1;
    this.current = undefined;
  }

  private forgetBefore(sequence: number): void {
    for (const each of this.frames.keys()) if (each < sequence) this.frames.delete(each);
  }

  private get oldest(): number {
    return Math.min(...this.frames.keys());
  }

  private get waitingMs(): number {
    return this.frames.size * FRAME_MS;
  }

  /** How uneven arrivals are decides how long is waited. */
  private learn(transitMs: number): void {
    this.transits.push(transitMs);
    if (this.transits.length > REMEMBERED) this.transits.shift();
    const sorted = [...this.transits].sort((a, b) => a - b);
    const usual = sorted[Math.floor(SHARE * (sorted.length - 1))] ?? 0;
    const spread = usual - (sorted[0] ?? 0) + MARGIN_MS;
    this.targetMs = Math.min(Math.max(spread, LEAST_MS), MOST_MS);
  }

  /** Chooses what the next 20 ms are; false: nobody speaks. */
  private begin(): boolean {
    if (this.next < 0) {
      if (this.frames.size === 0 || this.waitingMs < this.targetMs) return false;
      this.next = this.oldest;
      this.missing = 1; // fades in
    } else {
      this.catchUp();
    }
    const frame = this.frames.get(this.next);
    this.frames.delete(this.next);
    // The end of what was said, or of the connection.
    const paused = this.frames.size === 0 || this.oldest - this.next > PAUSE_FRAMES;
    if (!frame && paused && this.missing >= RESTART_FRAMES) {
      this.next = -1;
      this.current = undefined;
      return this.begin();
    }
    // Nothing newer either: wait for it, rather than lose it when it comes.
    if (frame || !paused) ++this.next;
    if (frame) ++this.counts.played;
    else if (!paused) ++this.counts.concealed;
    this.current = frame;
    return true;
  }

  /** With more waiting than is needed for a second, a frame is left out. */
  private catchUp(): void {
    const much = this.waitingMs > this.targetMs + 2 * FRAME_MS;
    this.surplus = much ? this.surplus + 1 : 0;
    const tooMuch = this.waitingMs > this.targetMs + MOST_MS / 2;
    if (this.surplus < CALM_FRAMES && !tooMuch) return;
    this.surplus = 0;
    if (this.frames.delete(this.next)) {
      ++this.counts.skipped;
      this.missing = Math.max(this.missing, 1); // fades in after the gap
    }
    ++this.next;
  }

  private copy(out: Float32Array, at: number, count: number): void {
    const { current, offset, last, missing } = this;
    for (let i = 0; i < count; ++i) {
      const index = offset + i;
      if (current) {
        const gain = missing > 0 ? Math.min(1, index / FADE) : 1;
        out[at + i] = gain * (current[index] ?? 0);
      } else {
        // The last 20 ms once more, quieter, and then nothing.
        const gain = missing === 0 ? Math.max(0, 1 - index / (FRAME - FADE)) : 0;
        out[at + i] = gain * (last[index] ?? 0);
      }
    }
    if (offset + count < FRAME) return;
    if (current) this.last = current;
    this.missing = current ? 0 : missing + 1;
  }
}
