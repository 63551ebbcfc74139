import type { View } from '../geometry/view';
import type { SceneOverlay } from '../scene/scene_overlay';
import type { Session } from '../session/session';
import type { MarkerPose } from '../session/types';
import { h } from './dom';

/** The scene over the live picture. three.js is loaded when there is first something to draw. */
export class SceneLayer {
  readonly element = h('div', { class: 'scene-layer' });
  private overlay: SceneOverlay | undefined;
  private loading = false;

  constructor(private readonly session: Session) {}

  /** What is seen from there, where the picture lies (CSS); `markers` as that very picture shows them. */
  draw(view: View | undefined, markers: readonly MarkerPose[], transform: string): void {
    const needed = this.session.scene.things.some(({ material }) => material !== 'real');
    if (needed) void this.load();
    if (this.element.style.transform !== transform) this.element.style.transform = transform;
    this.overlay?.draw(view, markers);
    this.element.dataset['things'] = String(this.session.scene.things.length); // for tests
  }

  private async load(): Promise<void> {
    if (this.loading) return;
    this.loading = true;
    try {
      const { SceneOverlay: Loaded } = await import('../scene/scene_overlay');
      const places = this.session.annotations;
      this.overlay = new Loaded(this.session.scene, (id) => places.get(id)?.anchor.pointInWorld);
      this.element.append(this.overlay.canvas);
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      console.warn(`the scene is not drawn: ${reason}`);
    }
  }
}
