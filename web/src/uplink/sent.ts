import type { Size, Turn } from './turn';

/** A picture on its way, as it is to be seen when the server has tracked it. */
export interface Sent {
  readonly pictureId: number;
  readonly capturedMs: number;
  encodedMs: number; // 0: not yet
  readonly turn: Turn;
  readonly size: Size; // upright
  readonly picture: HTMLCanvasElement;
}

/** The last pictures, each kept until its pose is here; their canvases are used again and again. */
export class SentRing {
  private readonly kept: Sent[] = [];
  private readonly spare: HTMLCanvasElement[] = [];
  private nextId = 1;

  constructor(
    private readonly most: number,
    private readonly make: () => HTMLCanvasElement = () => document.createElement('canvas'),
  ) {}

  /** A canvas of that size to draw the next one on. */
  add(capturedMs: number, turn: Turn, size: Size): Sent {
    if (this.kept.length >= this.most) {
      const oldest = this.kept.shift();
      if (oldest) this.spare.push(oldest.picture);
    }
    const picture = this.spare.pop() ?? this.make();
    if (picture.width !== size.width) picture.width = size.width;
    if (picture.height !== size.height) picture.height = size.height;
    const sent = { pictureId: this.nextId++, capturedMs, encodedMs: 0, turn, size, picture };
    this.kept.push(sent);
    return sent;
  }

  find(pictureId: number): Sent | undefined {
    return this.kept.find((sent) => sent.pictureId === pictureId);
  }

  get newest(): Sent | undefined {
    return this.kept.at(-1);
  }
}
