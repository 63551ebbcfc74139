import { Camera } from '../geometry/camera';
import type { Pixel } from '../geometry/vec3';
import { eyeOf, projectPoint, rayOf, type View } from '../geometry/view';
import { lineOfSight } from '../scene/gaze_sight';
import type { Look, MapView, ShownFrame } from '../scene/map_view';
import type { ViewName } from '../scene/viewpoint';
import { toIntrinsics } from '../session/convert';
import { gazeKey } from '../session/gaze';
import type { Session } from '../session/session';
import { isPlaced, type Pose } from '../session/types';
import type { MapContent } from '../tools/landing';
import { hitSurfaces } from '../tools/surface_rays';
import type { AppState } from './app_state';
import { h, setAttribute } from './dom';
import { keepLook, MapControls, nextLook, nextView, recallLook } from './map_controls';
import { Pane } from './pane';
import type { PictureCache } from './picture_cache';
import type { Player } from './player';
import type { PictureRect } from './pointer_layer';
import { surfaceWords } from './surface_words';

/** The 3D map: three.js below, the same marks as on the video above it. */
export class MapPane extends Pane {
  map: MapView | undefined; // arrives after the video: three.js is the larger part of the page
  private readonly canvas: HTMLCanvasElement;
  private readonly controls = new MapControls({
    show: (look) => this.show(look),
    stand: (view) => this.stand(view),
  });
  private shows = recallLook();
  private drawnKey = '';
  private lens: Camera | undefined; // as pictures come

  constructor(session: Session, player: Player, state: AppState, pictures: PictureCache) {
    const canvas = h('canvas', { class: 'map' });
    const words = { className: 'map3d', label: '3D map', title: 'Map' };
    super('map', words, [canvas], session, player, state, pictures);
    this.canvas = canvas;
    this.element.append(this.controls.element);
  }

  /** What of the place is drawn, from now on and the next time. */
  show(look: Look): void {
    this.shows = look;
    keepLook(look);
    if (this.map) this.map.drawn = look;
    this.state.changed();
  }

  /** Looks from there; false, and why in words, where that cannot be. */
  stand(view: ViewName): boolean {
    const why = this.map ? this.map.look(view, this.eye()) : 'the map is not shown yet';
    if (why !== undefined) this.state.refuse('map', `Not seen from there: ${why}.`);
    this.state.changed();
    return why === undefined;
  }

  /** The next choice, by key; a view that cannot be is passed over. */
  next(name: 'show' | 'stand'): void {
    if (name === 'show') return this.show(nextLook(this.shows));
    const next = nextView(this.map?.eye.view ?? 'orbit');
    if (!this.stand(next)) this.stand(nextView(next));
  }

  get walks(): boolean {
    return this.map?.eye.turnsHead ?? false;
  }

  async load(): Promise<void> {
    try {
      const { MapView: Loaded } = await import('../scene/map_view');
      this.map = new Loaded(this.canvas, this.player.canvas, this.session);
      this.map.drawn = this.shows;
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
    this.map.turnTo(at);
    this.map.hold();
  }

  /** What is drawn there, and beneath dots that are not drawn. */
  contentAt(view: View, pixel: Pixel): MapContent {
    const features = this.session.map.features.values();
    const { map } = this;
    const directionInWorld = rayOf(view, pixel);
    if (!map?.showsSurfaces || !directionInWorld) return { features };
    const ray = { originInWorld: eyeOf(view), directionInWorld };
    const surface = hitSurfaces(map.surfaces.meshes(), ray);
    return { features: surface && !map.showsDots ? [] : features, surface };
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
    this.map.eye.zoom(factor, (u - cx) / fx, (v - cy) / fy);
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
    this.controls.update(this.shows, map.eye.view);
    const { view: from, settled } = map.eye;
    setAttribute(this.canvas, 'data-from', settled ? from : `to ${from}`);
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
    this.canvas.dataset['surfaces'] = this.map?.showsSurfaces
      ? String(this.map.surfaces.triangles)
      : '0';
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
    const { map: map3d } = this;
    const large = this.state.main === 'map';
    const missing =
      large && map3d && surfaceWords(this.shows, map3d.surfaces, this.session.surface.state);
    let text = '';
    if (refusal) text = refusal;
    else if (!map3d) text = 'loading the map';
    else if (map.features.size === 0) text = 'nothing mapped yet';
    else if (missing) text = missing;
    else if (large && map3d.eye.view === 'walk')
      text = 'W A S D or arrows walk, drag to look; Esc ends it';
    else if (pose && !pose.metric) text = 'scale unknown: no target was seen, sizes are relative';
    this.setNote(text);
  }
}
