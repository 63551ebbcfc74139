import type { View } from '../geometry/view';
import type { SceneOverlay } from '../scene/scene_overlay';
import { SceneBook } from '../session/scene_book';
import type { Session } from '../session/session';
import { h } from './dom';

const LOOK_MS = 1500;

/** The scene over the live picture. three.js is loaded when there is first something to draw. */
export class SceneLayer {
  readonly element = h('div', { class: 'scene-layer' });
  readonly book = new SceneBook();
  private overlay: SceneOverlay | undefined;
  private loading = false;

  constructor(private readonly session: Session) {
    setInterval(() => {
      if (session.live) void this.book.look(session.clients.scene, session.sessionId);
    }, LOOK_MS);
  }

  /** What is seen from there, where the picture lies (CSS). */
  draw(view: View | undefined, transform: string): void {
    const needed = this.book.things.some(({ material }) => material !== 'real');
    if (needed) void this.load();
    if (this.element.style.transform !== transform) this.element.style.transform = transform;
    this.overlay?.draw(view);
    this.element.dataset['things'] = String(this.book.things.length); // for tests
  }

  private async load(): Promise<void> {
    if (this.loading) return;
    this.loading = true;
    try {
      const { SceneOverlay: Loaded } = await import('../scene/scene_overlay');
      const places = this.session.annotations;
      this.overlay = new Loaded(this.book, (id) => places.get(id)?.anchor.pointInWorld);
      this.element.append(this.overlay.canvas);
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      console.warn(`the scene is not drawn: ${reason}`);
    }
  }
}
