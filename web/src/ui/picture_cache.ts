import type { Annotation } from '../session/types';

/** Pictures of marks once they are there, each fetched once. */
export class PictureCache {
  private readonly kept = new Map<string, ImageBitmap | undefined>();

  /** `arrived` hears of each one. */
  constructor(
    private readonly fetchBytes: (id: string) => Promise<Uint8Array<ArrayBuffer>>,
    private readonly arrived: () => void,
  ) {}

  /** Undefined until its bytes are here; then they are asked for. */
  get({ id, picture }: Annotation): ImageBitmap | undefined {
    if (!picture?.sha256) return undefined;
    const { sha256 } = picture;
    if (!this.kept.has(sha256)) void this.load(id, sha256);
    return this.kept.get(sha256);
  }

  private async load(id: string, sha256: string): Promise<void> {
    this.kept.set(sha256, undefined); // asked for
    try {
      const bitmap = await createImageBitmap(new Blob([await this.fetchBytes(id)]));
      this.kept.set(sha256, bitmap);
    } catch {
      setTimeout(() => this.kept.delete(sha256), RETRY_MS); // the outline has to do until then
    }
    this.arrived();
  }
}

const RETRY_MS = 5000;
