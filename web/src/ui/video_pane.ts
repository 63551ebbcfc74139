import type { Pixel } from '../geometry/vec3';
import { makeView, projectPoint, type View } from '../geometry/view';
import { edgeArrowsOf } from '../scene/edge_arrows';
import { sightInPicture } from '../scene/gaze_sight';
import type { Session } from '../session/session';
import { pageNowMs } from '../session/clock';
import { type FeatureState, type FrameFacts, isPlaced } from '../session/types';
import type { AppState } from './app_state';
import { arrowLabel } from './gaze_words';
import { Pane } from './pane';
import type { PictureCache } from './picture_cache';
import type { Player } from './player';
import type { PictureRect } from './pointer_layer';
import { save, takeSnapshot } from './snapshot';
import { SceneLayer } from './scene_layer';
import { Still } from './still';
import { crowdedWords, lostWords, pauseWords } from './words';

const STALE_MS = 1000;

/** The live picture, or a frozen one, with the marks that belong to exactly that frame. */
export class VideoPane extends Pane {
  private still: Still | undefined;
  private readonly scene: SceneLayer;

  constructor(session: Session, player: Player, state: AppState, pictures: PictureCache) {
    const words = { className: 'video', label: 'Live video', title: 'Video' };
    super('video', words, [player.canvas], session, player, state, pictures);
    this.scene = new SceneLayer(session);
    player.canvas.after(this.scene.element);
  }

  get frozen(): boolean {
    return this.still !== undefined;
  }

  /** Holds the frame on the screen; false if there is none yet. */
  freeze(): boolean {
    const { shown, canvas } = this.player;
    if (!shown) return false;
    this.thaw();
    this.still = new Still(shown.facts, canvas, this.session);
    canvas.after(this.still.canvas);
    this.element.classList.add('frozen');
    return true;
  }

  /** Shows the live picture again. */
  thaw(): void {
    this.still?.canvas.remove();
    this.still = undefined;
    this.element.classList.remove('frozen');
  }

  /** The frame on the screen and the view it was taken from; undefined before the first. */
  current(): { facts: FrameFacts; view: View | undefined } | undefined {
    const facts = this.still?.facts ?? this.player.shown?.facts;
    if (!facts) return undefined;
    const { pose, camera } = facts;
    return { facts, view: isPlaced(pose) ? makeView(camera, pose.worldFromCamera) : undefined };
  }

  view(): View | undefined {
    return this.current()?.view;
  }

  /** Keeps the picture on the screen with its marks as a file. */
  async snapshot(takenBy: string): Promise<void> {
    const current = this.current();
    if (!current) throw new Error(this.whyNoPicture);
    const { session, state, player, still } = this;
    const marks = this.sameMap ? this.marks() : [];
    const annotations = session.annotations.list().filter((each) => state.draws(each));
    const pictures = current.view ? this.shownPictures(current.view, marks) : [];
    const blob = await takeSnapshot(
      still?.canvas ?? player.canvas,
      current.view,
      { marks, pictures },
      {
        ...{ facts: current.facts, source: session.joined?.source ?? '', takenBy },
        ...{ metric: session.scale.metric, annotations },
      },
    );
    save(blob, `saccade-${current.facts.frameId}.png`);
  }

  /** Picture pixel under a pointer; undefined outside the picture. */
  pixelAt(clientX: number, clientY: number): Pixel | undefined {
    const pixel = this.toPixel(clientX, clientY);
    const { u, v } = this.within(pixel);
    return u === pixel.u && v === pixel.v ? pixel : undefined;
  }

  /** The same; outside, the nearest pixel of the picture. */
  pixelNear(clientX: number, clientY: number): Pixel {
    return this.within(this.toPixel(clientX, clientY));
  }

  private toPixel(clientX: number, clientY: number): Pixel {
    const box = this.element.getBoundingClientRect();
    const { left, top, scale } = this.layout();
    return {
      u: (clientX - box.left - left) / scale - 0.5,
      v: (clientY - box.top - top) / scale - 0.5,
    };
  }

  private within({ u, v }: Pixel): Pixel {
    const { width, height } = this.layout();
    const clamp = (value: number, size: number): number =>
      Math.min(Math.max(value, -0.5), size - 0.5);
    return { u: clamp(u, width), v: clamp(v, height) };
  }

  /** A place in the picture, as shares of it, in pixels of the page. */
  placeAt(across: number, down: number): { x: number; y: number } {
    const box = this.element.getBoundingClientRect();
    const { left, top, scale, width, height } = this.layout();
    return {
      x: box.left + left + across * width * scale,
      y: box.top + top + down * height * scale,
    };
  }

  /** CSS pixels of a distance in the picture's. */
  get scale(): number {
    return this.layout().scale;
  }

  protected layout(): PictureRect {
    const { width: paneWidth, height: paneHeight } = this.size;
    const width = Math.max(this.player.canvas.width, 1);
    const height = Math.max(this.player.canvas.height, 1);
    const scale = Math.min(paneWidth / width, paneHeight / height);
    return {
      left: (paneWidth - width * scale) / 2,
      top: (paneHeight - height * scale) / 2,
      scale,
      width,
      height,
    };
  }

  draw(): void {
    if (this.still && !this.still.valid) this.thaw();
    const layout = this.layout();
    this.place(layout);
    const begin = performance.now();
    this.painter.begin(this.size, layout);
    this.painter.clip(layout.width, layout.height);
    const current = this.current();
    const markers = current?.facts.pose?.markers ?? [];
    this.scene.draw(current?.view, markers, this.player.canvas.style.transform);
    if (current?.view) this.drawFrame(current.facts, current.view);
    this.painter.end();
    this.took(performance.now() - begin);
    this.drawPointers();
    this.painter.canvas.dataset['frameId'] = current ? String(current.facts.frameId) : '';
    this.updateNote();
  }

  private place({ left, top, scale }: { left: number; top: number; scale: number }): void {
    const transform = `translate(${left}px, ${top}px) scale(${scale})`;
    for (const canvas of [this.player.canvas, this.still?.canvas]) {
      if (canvas && canvas.style.transform !== transform) canvas.style.transform = transform;
    }
  }

  private drawFrame(facts: FrameFacts, view: View): void {
    this.drawFeatures(facts, view);
    const marks = this.drawMarks(view);
    this.painter.edgeArrows(edgeArrowsOf(view, marks), this.accented);
    this.drawSight(view);
    this.drawLanding(view, ({ pixel }) => pixel);
  }

  /** What the camera is to look at, and where it looks now: the distance is the error. */
  private drawSight(view: View): void {
    const { gaze } = this.session;
    const sight = gaze && sightInPicture(view, gaze);
    if (sight) {
      const { cx, cy } = view.camera.intrinsics;
      this.painter.centre({ u: cx, v: cy });
    }
    if (gaze && sight?.arrow) {
      this.painter.edgeArrows([sight.arrow], []);
      this.painter.arrowWords(arrowLabel(gaze), sight.arrow);
    }
    this.drawTarget(view, sight?.at);
  }

  /**
   * As measured, or sought in vain, only what this very frame says so of, and where it says. All others
   * are where its own pose puts them, as not searched for: what another frame saw is not seen here.
   */
  private drawFeatures(facts: FrameFacts, view: View): void {
    const { map } = this.session;
    const sameMap = this.still !== undefined || facts.pose?.mapRevision === map.revision;
    const places: Record<FeatureState, Pixel[]> = { not_attempted: [], failed: [], measured: [] };
    for (const { id, pointInWorld } of sameMap
      ? (this.still?.features ?? map.features.values())
      : []) {
      if (facts.features?.has(id)) continue;
      const at = projectPoint(view, pointInWorld);
      if (at && facts.camera.inImage(at)) places.not_attempted.push(at);
    }
    for (const { state, pixel } of facts.features?.values() ?? []) {
      if (facts.camera.inImage(pixel)) places[state].push(pixel);
    }
    for (const state of ['not_attempted', 'failed', 'measured'] as const) {
      this.painter.features(state, places[state]);
    }
  }

  /** False if the map has jumped since the frame shown: its pose says nothing about today's map. */
  get sameMap(): boolean {
    const facts = this.current()?.facts;
    return facts?.pose?.mapRevision === this.session.pose?.mapRevision;
  }

  /** Why it cannot be frozen or kept. */
  get whyNoPicture(): string {
    const { pause } = this.session.talk;
    return pause ? `${pauseWords(pause)}.` : 'There is no picture yet.';
  }

  private updateNote(): void {
    const { player, state, session, still } = this;
    const refusal = state.refusal('video');
    const nowMs = pageNowMs();
    const age = player.shown ? nowMs - player.shown.drawnMs : 0;
    const stale = age > STALE_MS && !session.sourceEnded;
    let text = '';
    if (player.unsupported) text = `No video. ${player.unsupported}`;
    else if (refusal) text = refusal;
    else if (session.link.kind === 'crowded') text = crowdedWords(session.link.tabs);
    else if (still) {
      text = `frozen, ${((nowMs - still.sinceMs) / 1000).toFixed(0)} s: P goes on`;
      if (!this.sameMap) text += '. The map has changed since: marks are not where they were';
    } else if (session.talk.pause) text = pauseWords(session.talk.pause);
    else if (player.shown && stale) text = `picture is ${(age / 1000).toFixed(0)} s old`;
    else if (!player.shown && session.live) text = 'waiting for the first picture';
    else if (player.shown) {
      if (player.darkness.black) text = 'The picture is black: uncover the lens, or make light';
      else if (session.live) text = lostWords(session.pose);
    }
    this.setNote(text);
    this.element.classList.toggle('stale', stale && !still);
    this.element.classList.toggle('paused', session.talk.pause !== undefined);
  }
}
