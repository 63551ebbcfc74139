import { multiply } from '../geometry/rigid3';
import { add, scale, type Vec3, ZERO } from '../geometry/vec3';
import { depthOf } from '../geometry/view';
import type { Model, Thing } from '../session/scene_book';
import { type Placed, SceneEdits, type ThingDraft } from '../session/scene_edits';
import type { Session } from '../session/session';
import type { Landing } from '../tools/landing';
import { aboveFloor, beforeWall, DOWN, type Way, wayInWorld } from '../tools/thing_places';
import { hitSurface, pickThing, sizeOf } from '../tools/thing_rays';
import { about } from '../tools/turn';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import { whyNotEdit } from './rights';
import { libraryFile } from './thing_library';
import { ThingMeasure } from './thing_measure';
import { ThingRegister } from './thing_register';
import type { Spot } from './thing_spot';

/** What a click with the tool does; a model by its name in the library or its id. */
export type ThingClick =
  | 'select'
  | 'move'
  | 'plane'
  | 'box'
  | 'register'
  | `library ${string}`
  | `model ${string}`;

const TURN_STEP_DEG = 15;
const MODEL_NAME_BYTES = 90;

/** Places, pushes, measures and registers things of the scene, one after the other. */
export class Things {
  clickDoes: ThingClick = 'select';
  against: 'floor' | 'wall' = 'floor';
  said = { text: '', warn: false };
  readonly edits: SceneEdits;
  readonly register: ThingRegister;
  private readonly measure: ThingMeasure;
  private busy = false;

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly aim: Aim,
  ) {
    this.edits = new SceneEdits(session);
    const colour = (): number => state.colorRgba;
    this.register = new ThingRegister(session, this.edits, colour);
    this.measure = new ThingMeasure(session, colour);
  }

  /** Brings the keyboard to the panel. */
  focus = (): void => undefined;

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
    this.say(this.hint(), false);
    if (does === 'register') void this.begin();
  }

  private async begin(): Promise<void> {
    await this.register.begin(this.selected);
    this.say(this.register.step, false);
  }

  /** What the next click does, in words. */
  private hint(): string {
    const { clickDoes } = this;
    if (clickDoes === 'plane' || clickDoes === 'box') return this.measure.hint(clickDoes);
    if (clickDoes === 'move') return 'Click where the selected thing is to stand.';
    if (clickDoes === 'select') return 'Click a thing, or drag the selected one to push it.';
    return `Click a place on the ${this.against}.`;
  }

  /** True where there is something to give up. */
  get begun(): boolean {
    return this.measure.begun || this.register.thing !== undefined;
  }

  cancel(): void {
    if (!this.begun) return;
    this.measure.cancel();
    this.register.cancel();
    this.clickDoes = 'select';
    this.say(this.hint(), false);
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
    return ['plane', 'box', 'register'].includes(this.clickDoes);
  }

  click(pane: PaneName, spot: Spot | undefined): void {
    const { clickDoes } = this;
    if (!spot) return this.refuse(pane, this.aim.whyNoLanding(pane));
    if (clickDoes === 'select') {
      const picked = pickThing(this.session.scene.things, this.session.scene.models, spot.ray);
      return this.select(picked?.id ?? '');
    }
    if (clickDoes === 'register') {
      return this.run(pane, async () => {
        const why = await this.register.click(spot, this.aim.scale(pane));
        if (why !== undefined) throw new Error(why);
        return this.register.step;
      });
    }
    if (clickDoes === 'plane' || clickDoes === 'box') return this.measureAt(pane, clickDoes, spot);
    if (clickDoes === 'move') {
      const thing = this.selected;
      if (!thing) return this.refuse(pane, 'select the thing in the list first');
      const sizeM = sizeOf(thing, this.session.scene.models);
      return this.run(pane, () => this.placeAt(pane, spot, thing, sizeM));
    }
    this.run(pane, async () => {
      const model = await this.modelOf(clickDoes);
      const words = await this.placeAt(pane, spot, this.draftOf(model), model.sizeM);
      this.clickDoes = 'select'; // one click, one thing
      return words;
    });
  }

  private async modelOf(does: ThingClick): Promise<Model> {
    const name = does.slice(does.indexOf(' ') + 1);
    const known = this.session.scene.models.find(({ id }) => id === name);
    if (known) return known;
    return this.edits.upload(name, await libraryFile(name), () => undefined);
  }

  private draftOf({ id, name }: Model): ThingDraft {
    return {
      ...{ name: this.freeName(name), shape: 'model', material: 'virtual', modelId: id },
      ...{ sizeM: ZERO, scale: 1, annotationId: '', colorRgba: 0 },
      parentFromObject: { rotation: about(DOWN, 0), translation: ZERO },
    };
  }

  private freeName(name: string): string {
    const taken = new Set(this.session.scene.things.map((one) => one.name));
    let free = name;
    for (let n = 2; taken.has(free); ++n) free = `${name} ${n}`;
    return free;
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

  private placed({ thing, stop, support }: Placed): string {
    this.state.thingId = thing.id;
    const moved = stop ? `touches ${stop.name} after ${stop.movedM.toFixed(3)} m, ` : '';
    return `${thing.name} ${moved}rests on ${support.name}`;
  }

  private measureAt(pane: PaneName, shape: 'plane' | 'box', spot: Spot): void {
    this.run(pane, async () => {
      const draft = this.measure.click(shape, spot, this.freeName(shape));
      if (!draft) return this.measure.hint(shape);
      const { id, name, sizeM } = await this.edits.put(draft);
      this.state.thingId = id;
      this.clickDoes = 'select';
      const sides = shape === 'box' ? [sizeM.x, sizeM.y, sizeM.z] : [sizeM.x, sizeM.z];
      return `${name}: ${sides.map((side) => side.toFixed(3)).join(' × ')} m`;
    });
  }

  /** Along the floor as the main view sees it, until it touches; then it is lowered until it rests. */
  push(way: Way): void {
    const view = this.aim.view(this.state.main);
    if (!view) return this.say(`Not pushed: ${this.aim.whyNoLanding(this.state.main)}`, true);
    this.pushTowards(wayInWorld(view, way));
  }

  pushTowards(way: Vec3): void {
    this.withSelected('pushed', (thing) => this.edits.place(thing, way));
  }

  turn(sign: 1 | -1): void {
    const turn = about(DOWN, (sign * TURN_STEP_DEG * Math.PI) / 180);
    this.withSelected('turned', (thing) => {
      const { rotation, translation } = thing.parentFromObject;
      return this.edits.place({
        ...thing,
        parentFromObject: {
          rotation: multiply(turn, rotation),
          translation: add(translation, scale(DOWN, -0.002)),
        },
      });
    });
  }

  remove(): void {
    const thing = this.selected;
    if (!thing) return this.say('Not deleted: select a thing first.', true);
    this.run('map', async () => {
      await this.edits.remove(thing.id);
      this.state.thingId = '';
      return `${thing.name} deleted; Undo brings it back`;
    });
  }

  undo(): void {
    this.run('map', () => this.edits.undo());
  }

  accept(): void {
    this.run('map', () => this.register.accept());
  }

  /** A GLB file dropped on a pane, or chosen: where it was dropped it is let go. */
  take(pane: PaneName, spot: Spot | undefined, file: File): void {
    this.run(pane, async () => {
      const name = file.name.replace(/\.glb$/i, '').slice(0, MODEL_NAME_BYTES) || 'model';
      const bytes = new Uint8Array(await file.arrayBuffer());
      const model = await this.edits.upload(name, bytes, (share) =>
        this.say(`${file.name}: ${(100 * share).toFixed(0)} % sent`, false),
      );
      if (spot) return this.placeAt(pane, spot, this.draftOf(model), model.sizeM);
      this.clickDoes = `model ${model.id}`;
      return `${name} is there: ${this.hint()}`;
    });
  }

  private withSelected(done: string, act: (thing: Thing) => Promise<Placed>): void {
    const thing = this.selected;
    if (!thing) return this.say(`Not ${done}: select a thing first.`, true);
    if (thing.material === 'real') {
      return this.say(`Not ${done}: ${thing.name} is real: it stays where it is.`, true);
    }
    this.run('map', async () => this.placed(await act(thing)), `Not ${done}: `);
  }

  /** One at a time: what comes meanwhile is passed over, as a key that is held. */
  private run(pane: PaneName, act: () => Promise<string>, words = 'Not done: '): void {
    const why = whyNotEdit(this.session);
    if (why !== undefined) return this.say(why, true);
    if (this.busy) return;
    this.busy = true;
    void act()
      .then((text) => this.say(text, false))
      .catch((error: unknown) => {
        const reason = error instanceof Error ? error.message : String(error);
        if (pane !== 'map' || this.state.main === 'map') this.state.refuse(pane, words + reason);
        this.say(words + reason, true);
      })
      .finally(() => {
        this.busy = false;
      });
  }

  private refuse(pane: PaneName, why: string): void {
    this.state.refuse(pane, `Not done: ${why}`);
    this.say(`Not done: ${why}`, true);
  }

  private say(text: string, warn: boolean): void {
    this.said = { text, warn };
    this.state.changed();
  }
}
