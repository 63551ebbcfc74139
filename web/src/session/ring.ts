/** The newest `capacity` things by frame id; ids arrive in rising order. */
export class FrameRing<T> {
  private readonly entries = new Map<number, T>();

  constructor(private readonly capacity: number) {}

  set(frameId: number, value: T): void {
    this.entries.delete(frameId);
    this.entries.set(frameId, value);
    for (const oldest of this.entries.keys()) {
      if (this.entries.size <= this.capacity) break;
      this.entries.delete(oldest);
    }
  }

  get(frameId: number): T | undefined {
    return this.entries.get(frameId);
  }

  /** The newest value whose id is at most `frameId`. */
  atOrBefore(frameId: number): T | undefined {
    let best: T | undefined;
    let bestId = -Infinity;
    for (const [id, value] of this.entries) {
      if (id <= frameId && id > bestId) {
        bestId = id;
        best = value;
      }
    }
    return best;
  }

  clear(): void {
    this.entries.clear();
  }

  get size(): number {
    return this.entries.size;
  }
}
