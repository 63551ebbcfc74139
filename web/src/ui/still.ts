import { pageNowMs } from '../session/clock';
import type { Session } from '../session/session';
import type { Feature, FrameFacts } from '../session/types';

/**
 * A frame held on the screen, to be looked at and clicked while the live picture goes on. At once as
 * it was decoded, and as the server has kept it (grey without loss) as soon as that is there.
 */
export class Still {
  readonly canvas = document.createElement('canvas');
  readonly sinceMs = pageNowMs();
  /** The map as it was then, for as long as it is held: its pose says nothing about a later one. */
  readonly features: readonly Feature[];
  private readonly sessionId: string;

  constructor(
    readonly facts: FrameFacts,
    live: HTMLCanvasElement,
    private readonly session: Session,
  ) {
    this.features = [...session.map.features.values()];
    this.sessionId = session.sessionId;
    this.canvas.className = 'still';
    this.canvas.width = live.width;
    this.canvas.height = live.height;
    this.canvas.dataset['frameId'] = String(facts.frameId);
    this.paint(live);
    this.sharpen().catch(() => undefined); // then what was decoded has to do
  }

  /** False once its session is over: frame ids begin anew with a server, so it names nothing now. */
  get valid(): boolean {
    return this.session.sessionId === this.sessionId;
  }

  private paint(picture: CanvasImageSource): void {
    const { width, height } = this.canvas;
    this.canvas.getContext('2d', { alpha: false })?.drawImage(picture, 0, 0, width, height);
  }

  private async sharpen(): Promise<void> {
    const png = await this.session.fetchPng(this.facts.frameId);
    if (!this.valid) return;
    const bitmap = await createImageBitmap(new Blob([png], { type: 'image/png' }));
    this.paint(bitmap);
    bitmap.close();
    this.canvas.dataset['lossless'] = 'true';
  }
}
