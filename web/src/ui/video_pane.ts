import type { Pixel } from '../geometry/vec3';
import { makeView, projectPoint, type View } from '../geometry/view';
import { axisStrokes, strokesOf } from '../scene/strokes';
import type { Session } from '../session/session';
import { pageNowMs } from '../session/clock';
import { type FrameFacts, isPlaced } from '../session/types';
import { landingWords, ringRadius } from '../tools/landing';
import type { AppState } from './app_state';
import { h, setText } from './dom';
import { allMarks } from './marks';
import { Painter } from './painter';
import type { Player } from './player';

const STALE_MS = 1000;

/** The live picture with the marks that belong to exactly that frame. */
export class VideoPane {
  readonly element: HTMLElement;
  private readonly painter = new Painter();
  private readonly note = h('p', { class: 'pane-note', role: 'status' });

  constructor(
    private readonly session: Session,
    private readonly player: Player,
    private readonly state: AppState,
  ) {
    this.element = h(
      'section',
      { class: 'pane video', 'aria-label': 'Live video', tabindex: '0' },
      player.canvas,
      this.painter.canvas,
      h('h2', { class: 'pane-title' }, 'Video'),
      this.note,
    );
  }

  /** The frame on the screen and the view it was taken from; undefined before the first. */
  current(): { facts: FrameFacts; view: View | undefined } | undefined {
    const facts = this.player.shown?.facts;
    if (!facts) return undefined;
    const { pose, camera } = facts;
    return { facts, view: isPlaced(pose) ? makeView(camera, pose.worldFromCamera) : undefined };
  }

  /** Picture pixel under a pointer; undefined outside the picture. */
  pixelAt(clientX: number, clientY: number): Pixel | undefined {
    const box = this.element.getBoundingClientRect();
    const { left, top, scale, width, height } = this.layout();
    const u = (clientX - box.left - left) / scale - 0.5;
    const v = (clientY - box.top - top) / scale - 0.5;
    const inside = u >= -0.5 && v >= -0.5 && u <= width - 0.5 && v <= height - 0.5;
    return inside ? { u, v } : undefined;
  }

  /** CSS pixels of a distance in the picture's. */
  get scale(): number {
    return this.layout().scale;
  }

  private layout(): { left: number; top: number; scale: number; width: number; height: number } {
    const { clientWidth, clientHeight } = this.element;
    const width = Math.max(this.player.canvas.width, 1);
    const height = Math.max(this.player.canvas.height, 1);
    const scale = Math.min(clientWidth / width, clientHeight / height);
    return {
      left: (clientWidth - width * scale) / 2,
      top: (clientHeight - height * scale) / 2,
      scale,
      width,
      height,
    };
  }

  draw(): void {
    const layout = this.layout();
    const { canvas } = this.player;
    canvas.style.transform = `translate(${layout.left}px, ${layout.top}px) scale(${layout.scale})`;
    const { clientWidth, clientHeight } = this.element;
    this.painter.begin({ width: clientWidth, height: clientHeight }, layout);
    this.painter.clip(layout.width, layout.height);
    const current = this.current();
    if (current) this.drawFrame(current.facts, current.view);
    this.painter.end();
    this.painter.canvas.dataset['frameId'] = current ? String(current.facts.frameId) : '';
    this.updateNote();
  }

  private drawFrame(facts: FrameFacts, view: View | undefined): void {
    if (!view) return;
    this.drawFeatures(facts, view);
    this.painter.axes(axisStrokes(view));
    const { selectedId, pointedId } = this.state;
    this.painter.marks(strokesOf(view, allMarks(this.session.annotations)), [
      selectedId,
      pointedId,
    ]);
    const { hover } = this.state;
    if (hover?.pane !== 'video' || !hover.landing) return;
    const { landing, pixel } = hover;
    this.painter.ring(pixel, ringRadius(view, landing), landingWords(landing));
  }

  /**
   * Where exactly this frame saw them. Without a report for this very frame, their places are
   * projected with this frame's own pose, with the newest state known at that time.
   */
  private drawFeatures(facts: FrameFacts, view: View): void {
    const { map } = this.session;
    const exact = map.seenIn(facts.frameId);
    for (const { id, state, pixel } of exact ?? map.seenUpTo(facts.frameId) ?? []) {
      const feature = map.features.get(id);
      const at = exact ? pixel : feature && projectPoint(view, feature.pointInWorld);
      if (at && facts.camera.inImage(at)) this.painter.feature(at, state);
    }
  }

  private updateNote(): void {
    const { player, state, session } = this;
    const refusal = state.refusal('video');
    const age = player.shown ? pageNowMs() - player.shown.drawnMs : 0;
    let text = '';
    if (player.unsupported) text = `No video. ${player.unsupported}`;
    else if (refusal) text = refusal;
    else if (player.shown && age > STALE_MS && !session.sourceEnded) {
      text = `picture is ${(age / 1000).toFixed(0)} s old`;
    } else if (!player.shown && session.live) text = 'waiting for the first picture';
    setText(this.note, text);
    this.element.classList.toggle('stale', age > STALE_MS && !session.sourceEnded);
  }
}
