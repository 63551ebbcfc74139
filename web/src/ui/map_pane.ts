import { Camera } from '../geometry/camera';
import type { Pixel } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { lineOfSight } from '../scene/gaze_sight';
import type { MapView, ShownFrame } from '../scene/map_view';
import { toIntrinsics } from '../session/convert';
import { gazeKey } from '../session/gaze';
import type { Session } from '../session/session';
import { isPlaced, type Pose } from '../session/types';
import type { AppState } from './app_state';
import { h } from './dom';
import { Pane } from './pane';
import type { PictureCache } from './picture_cache';
import type { Player } from './player';
import type { PictureRect } from './pointer_layer';

/** The 3D map: three.js below, the same marks as on the video above it. */
export class MapPane extends Pane {
  map: MapView | undefined; // arrives after the video: three.js is the larger part of the page
  private readonly canvas: HTMLCanvasElement;
  private drawnKey = '';
  private lens: Camera | undefined; // as pictures come

  constructor(session: Session, player: Player, state: AppState, pictures: PictureCache) {
    const canvas = h('canvas', { class: 'map' });
    const words = { className: 'map3d', label: '3D map', title: 'Map' };
    super('map', words, [canvas], session, player, state, pictures);
    this.canvas = canvas;
  }

  async load(): Promise<void> {
    try {
      const { MapView: Loaded } = await import('../scene/map_view');
      this.map = new Loaded(this.canvas, this.player.canvas, this.session);
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      this.state.refuse('map', `No 3D map: ${reason}`);
    }
  }

  view(): View | undefined {
    return this.map?.view();
  }

  /** Turns the view to a mark, as near as it is now. */
  lookAt(annotationId: string): void {
    const at = this.session.annotations.get(annotationId)?.anchor.pointInWorld;
    if (!at || !this.map) return;
    this.map.following = false;
    this.map.orbit.follow(at);
    this.map.hold();
  }

  /** Where the wearer's camera appears, in CSS pixels of this pane. */
  cameraAt(): Pixel | undefined {
    const view = this.view();
    const pose = this.pose;
    return view && isPlaced(pose)
      ? projectPoint(view, pose.worldFromCamera.translation)
      : undefined;
  }

  pixelAt(clientX: number, clientY: number): Pixel {
    const box = this.element.getBoundingClientRect();
    return { u: clientX - box.left - 0.5, v: clientY - box.top - 0.5 };
  }

  /** Closer or farther, keeping what is under the pointer there. */
  zoomAt(factor: number, clientX: number, clientY: number): void {
    const view = this.view();
    if (!this.map || !view) return;
    const { fx, fy, cx, cy } = view.camera.intrinsics;
    const { u, v } = this.pixelAt(clientX, clientY);
    this.map.orbit.zoom(factor, (u - cx) / fx, (v - cy) / fy);
  }

  /** `screenFps`: what this computer manages; with little, the map yields to the video. */
  draw(nowMs: number, screenFps: number): void {
    const { map } = this;
    const { width, height } = this.size;
    this.updateNote();
    if (!map) return;
    map.resize(width, height);
    map.pictureIntervalMs = screenFps > 0 && screenFps < 45 ? 150 : 0;
    map.selectedThing = this.state.tool === 'thing' ? this.state.thingId : '';
    const moved = map.draw(nowMs, this.eye());
    this.drawPointers();
    const { version } = this.session.annotations;
    const gaze = gazeKey(this.session.gaze);
    const key = `${version} ${gaze} ${this.state.drawn}`;
    if (!moved && key === this.drawnKey) return;
    this.drawnKey = key;
    const begin = performance.now();
    this.drawOver(map.view(), width, height);
    this.took(performance.now() - begin);
  }

  /** Of the picture shown; while there is none to be shown, the newest. */
  private get pose(): Pose | undefined {
    const { session, player } = this;
    return session.talk.pause ? session.pose : player.shown?.facts.pose;
  }

  /** The wearer's camera where it is to be drawn, with its picture or, while that is paused, without. */
  private eye(): ShownFrame | undefined {
    const { pose, session } = this;
    const facts = this.player.shown?.facts;
    this.lens = facts?.camera ?? this.lens;
    const pb = session.joined?.intrinsics;
    if (!this.lens && session.talk.pause && pb) this.lens = new Camera(toIntrinsics(pb));
    const camera = this.lens;
    if (!camera || !isPlaced(pose)) return undefined;
    const { frameId, worldFromCamera } = pose;
    return { frameId, camera, worldFromCamera, picture: facts !== undefined };
  }

  protected layout(): PictureRect {
    return { left: 0, top: 0, scale: 1, ...this.size };
  }

  private drawOver(view: View, width: number, height: number): void {
    this.painter.begin({ width, height }, { left: 0, top: 0, scale: 1 });
    this.drawMarks(view);
    this.drawSight(view);
    this.drawLanding(view, ({ landing }) => landing && projectPoint(view, landing.pointInWorld));
    const { translation: t, rotation: q } = view.worldFromCamera;
    this.canvas.dataset['eye'] = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].join(' ');
    this.canvas.dataset['focalPx'] = String(view.camera.intrinsics.fx);
  }

  /** The target, and the line to it from the camera as it is in the picture shown. */
  private drawSight(view: View): void {
    const target = this.session.gaze?.targetInWorld;
    const pose = this.pose;
    if (target && isPlaced(pose)) {
      this.painter.lineOfSight(lineOfSight(view, pose.worldFromCamera.translation, target));
    }
    this.drawTarget(view, target && projectPoint(view, target));
  }

  private updateNote(): void {
    const refusal = this.state.refusal('map');
    const { map, pose } = this.session;
    let text = '';
    if (refusal) text = refusal;
    else if (!this.map) text = 'loading the map';
    else if (map.features.size === 0) text = 'nothing mapped yet';
    else if (pose && !pose.metric) text = 'scale unknown: no target was seen, sizes are relative';
    this.setNote(text);
  }
}
