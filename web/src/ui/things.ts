import { scale, type Vec3 } from '../geometry/vec3';
import { depthOf } from '../geometry/view';
import type { Thing } from '../session/scene_book';
import { type Placed, SceneEdits, type ThingDraft } from '../session/scene_edits';
import type { Session } from '../session/session';
import type { Landing } from '../tools/landing';
import { aboveFloor, beforeWall, DOWN } from '../tools/thing_places';
import { hitSurface, pickThing, sizeOf } from '../tools/thing_rays';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { placedWords, ThingErrands } from './thing_errands';
import { ThingMarker } from './thing_marker';
import { isMeasured, type Measurement, ThingMeasure } from './thing_measure';
import { ThingModels } from './thing_models';
import { ThingMoves } from './thing_moves';
import {
  isOverlay,
  type Overlay,
  type OverlayKind,
  type OverlayPoint,
  pictureModel,
  ThingOverlays,
} from './thing_overlays';
import { ThingRegister } from './thing_register';
import type { Spot } from './thing_spot';

/** What a click with the tool does; a model by its name in the library or its id. */
export type ThingClick =
  | 'select'
  | 'move'
  | Measurement
  | 'register'
  | OverlayKind
  | `inside ${string}`
  | `library ${string}`
  | `model ${string}`;

const PICTURE_M = 0.8; // wide

/** Places, pushes, measures and registers things of the scene, one after the other. */
export class Things {
  clickDoes: ThingClick = 'select';
  against: 'floor' | 'wall' = 'floor';
  readonly edits: SceneEdits;
  readonly register: ThingRegister;
  private readonly measure: ThingMeasure;
  private readonly overlays: ThingOverlays;
  private readonly models: ThingModels;
  readonly moves: ThingMoves;
  readonly marker: ThingMarker;
  private readonly errands: ThingErrands;

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly aim: Aim,
  ) {
    this.edits = new SceneEdits(session);
    this.errands = new ThingErrands(session, state);
    const colour = (): number => state.colorRgba;
    this.moves = new ThingMoves(session, state, aim, this.edits, this.errands);
    this.marker = new ThingMarker(session, this.edits, this.errands, () => this.selected);
    this.register = new ThingRegister(session, this.edits, colour);
    this.measure = new ThingMeasure(session, colour);
    this.overlays = new ThingOverlays(session, colour);
    this.models = new ThingModels(session, this.edits);
  }

  /** Brings the keyboard to the panel. */
  focus = (): void => undefined;

  get said(): ThingErrands['said'] {
    return this.errands.said;
  }

  get selected(): Thing | undefined {
    return this.session.scene.thing(this.state.thingId);
  }

  select(id: string): void {
    this.state.thingId = id;
    if (this.clickDoes === 'register') void this.begin();
    this.state.changed();
  }

  choose(does: ThingClick): void {
    this.cancel();
    this.clickDoes = does;
    this.errands.say(this.hint());
    if (does === 'register') void this.begin();
  }

  private async begin(): Promise<void> {
    await this.register.begin(this.selected);
    this.errands.say(this.register.step);
  }

  /** What the next click does, in words. */
  private hint(): string {
    const { clickDoes } = this;
    if (isMeasured(clickDoes)) return this.measure.hint(clickDoes);
    if (isOverlay(clickDoes)) return this.overlays.hint(clickDoes);
    if (clickDoes.startsWith('inside '))
      return 'Click the middle of what it is to be seen through.';
    if (clickDoes === 'move') return 'Click where the selected thing is to stand.';
    if (clickDoes === 'select') return 'Click a thing, or drag the selected one to push it.';
    return `Click a place on the ${this.against}.`;
  }

  /** True where there is something to give up. */
  get begun(): boolean {
    return this.measure.begun || this.overlays.begun || this.register.thing !== undefined;
  }

  /** True while points of a way are clicked. */
  get hasWay(): boolean {
    return this.overlays.begun;
  }

  cancel(): void {
    if (!this.begun) return;
    this.measure.cancel();
    this.overlays.cancel();
    this.register.cancel();
    this.clickDoes = 'select';
    this.errands.say(this.hint());
  }

  /** Where a click would land: on a known surface, else where the map says. */
  landing(spot: Spot): Landing | undefined {
    if (this.measures) return spot.landing;
    const hit = hitSurface(this.session.scene.things, spot.ray);
    if (!hit) return spot.landing;
    const depthM = depthOf(spot.view, hit.pointInWorld);
    const { pointInWorld, normalInWorld } = hit;
    const target = { kind: 'ray', ...spot.ray } as const;
    return { target, pointInWorld, normalInWorld, sigmaM: 0.01, depthM, how: 'plane' };
  }

  private get measures(): boolean {
    return this.clickDoes === 'register' || isMeasured(this.clickDoes);
  }

  click(pane: PaneName, spot: Spot | undefined): void {
    const { clickDoes } = this;
    if (!spot) return this.errands.refuse(pane, this.aim.whyNoLanding(pane));
    if (clickDoes === 'select') {
      const picked = pickThing(this.session.scene.things, this.session.scene.models, spot.ray);
      return this.select(picked?.id ?? '');
    }
    if (clickDoes === 'register') {
      return this.errands.run(pane, async () => {
        const why = await this.register.click(spot, this.aim.scale(pane));
        if (why !== undefined) throw new Error(why);
        return this.register.step;
      });
    }
    if (isMeasured(clickDoes)) return this.measureAt(pane, clickDoes, spot);
    if (isOverlay(clickDoes)) return this.overlayAt(pane, clickDoes, spot);
    if (clickDoes === 'move') {
      const thing = this.selected;
      if (!thing) return this.errands.refuse(pane, 'select the thing in the list first');
      const sizeM = sizeOf(thing, this.session.scene.models);
      return this.errands.run(pane, () => this.placeAt(pane, spot, thing, sizeM));
    }
    this.errands.run(pane, async () => {
      const model = await this.models.of(clickDoes);
      const words = clickDoes.startsWith('inside ')
        ? this.added(await this.models.show(model, this.overlayPoint(pane, spot)))
        : await this.placeAt(pane, spot, this.models.draft(model), model.sizeM);
      this.clickDoes = 'select'; // one click, one thing
      return words;
    });
  }

  /** Ends a way that was clicked. */
  finish(): void {
    const { clickDoes } = this;
    if (!isOverlay(clickDoes) || !this.overlays.begun) return;
    this.errands.run(this.state.main, () => this.laid(this.overlays.finish(clickDoes)));
  }

  private overlayAt(pane: PaneName, kind: OverlayKind, spot: Spot): void {
    this.errands.run(pane, async () => {
      const overlay = this.overlays.click(kind, this.overlayPoint(pane, spot));
      return overlay ? this.laid(overlay) : this.overlays.hint(kind);
    });
  }

  private async laid(overlay: Overlay): Promise<string> {
    this.clickDoes = 'select';
    return this.added(await this.models.lay(overlay));
  }

  private added({ id, name }: Thing): string {
    this.state.thingId = id;
    return `${name} is there; Delete or Undo takes it away`;
  }

  private overlayPoint(pane: PaneName, spot: Spot): OverlayPoint {
    const landing = this.landing(spot);
    if (!landing) throw new Error(this.aim.whyNoLanding(pane));
    const { pointInWorld } = landing;
    const normalInWorld = landing.normalInWorld ?? scale(spot.ray.directionInWorld, -1);
    return { pointInWorld, normalInWorld, hit: hitSurface(this.session.scene.things, spot.ray) };
  }

  /** A room, or the selected thing changed, by numbers. */
  putNumbers(draft: ThingDraft): void {
    this.errands.run('map', async () => {
      const name = draft.id === undefined ? this.models.freeName(draft.name) : draft.name;
      const thing = await this.edits.put({ ...draft, name });
      this.state.thingId = thing.id;
      return draft.id === undefined ? `${name} is there` : `${name} is changed`;
    });
  }

  private async placeAt(
    pane: PaneName,
    spot: Spot,
    draft: ThingDraft,
    sizeM: Vec3,
  ): Promise<string> {
    const landing = this.landing(spot);
    if (!landing) throw new Error(this.aim.whyNoLanding(pane));
    const { pointInWorld, normalInWorld } = landing;
    const sight = spot.ray.directionInWorld;
    if (this.against === 'floor') {
      const start = aboveFloor(pointInWorld, sight);
      return this.placed(await this.edits.place({ ...draft, parentFromObject: start }));
    }
    const normal = normalInWorld ?? scale(sight, -1);
    const at = (floorY?: number) => beforeWall(pointInWorld, normal, sight, sizeM.z, floorY);
    const below = { originInWorld: at().start.translation, directionInWorld: DOWN };
    const floorY = hitSurface(this.session.scene.things, below)?.pointInWorld.y;
    const { start, push } = at(floorY);
    return this.placed(await this.edits.place({ ...draft, parentFromObject: start }, push));
  }

  private placed(placed: Placed): string {
    this.state.thingId = placed.thing.id;
    return placedWords(placed);
  }

  private measureAt(pane: PaneName, shape: Measurement, spot: Spot): void {
    this.errands.run(pane, async () => {
      const draft = this.measure.click(shape, spot, this.models.freeName(shape));
      if (!draft) return this.measure.hint(shape);
      const { id, name, sizeM } = await this.edits.put(draft);
      this.state.thingId = id;
      this.clickDoes = 'select';
      const sides = shape === 'plane' ? [sizeM.x, sizeM.z] : [sizeM.x, sizeM.y, sizeM.z];
      return `${name}: ${sides.map((side) => side.toFixed(3)).join(' × ')} m`;
    });
  }

  undo(): void {
    this.errands.run('map', () => this.edits.undo());
  }

  accept(): void {
    this.errands.run('map', () => this.register.accept());
  }

  /**
   * A GLB file dropped on a pane, or chosen: where it was dropped it is let go. A picture is shown through
   * what is clicked next.
   */
  take(pane: PaneName, spot: Spot | undefined, file: File): void {
    this.errands.run(pane, async () => {
      const picture = file.type.startsWith('image/');
      const bytes = picture
        ? await pictureModel(file, PICTURE_M)
        : new Uint8Array(await file.arrayBuffer());
      const model = await this.models.ofFile(file, bytes, (share) =>
        this.errands.say(`${file.name}: ${(100 * share).toFixed(0)} % sent`),
      );
      if (spot && !picture) return this.placeAt(pane, spot, this.models.draft(model), model.sizeM);
      this.clickDoes = picture ? `inside ${model.id}` : `model ${model.id}`;
      return `${model.name} is there: ${this.hint()}`;
    });
  }
}
