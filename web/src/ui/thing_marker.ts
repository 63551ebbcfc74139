import { compose, IDENTITY, inverse, type Rigid3 } from '../geometry/rigid3';
import type { Marker, Thing } from '../session/scene_book';
import type { SceneEdits } from '../session/scene_edits';
import type { Session } from '../session/session';
import { sleep } from '../session/sleep';
import { worldFromThing } from '../session/thing_place';
import { h, setClass, setText } from './dom';
import type { ThingErrands } from './thing_errands';

/** What a detector of grey pictures knows (server/markers). */
const FAMILIES = [
  'apriltag36h11',
  'apriltag25h9',
  'aruco_4x4_50',
  'aruco_5x5_250',
  'aruco_6x6_250',
];
const SEEN_MS = 6000;
const STEP_MS = 100;

/** Fixes the selected thing, where it is, to a square marker that moves; or lets it go where it is. */
export class ThingMarker {
  readonly element = h('details', { class: 'numbers marker' });
  private readonly family = h('select', { 'aria-label': 'Family of the marker' });
  private readonly number = h('input', { type: 'number', min: '0', step: '1', value: '0' });
  private readonly side = h('input', { type: 'number', min: '0.005', step: 'any', value: '0.08' });
  private readonly moved = h('p', { class: 'none' });
  private readonly release = h('button', { type: 'button' }, 'Let go');

  constructor(
    private readonly session: Session,
    private readonly edits: SceneEdits,
    private readonly errands: ThingErrands,
    private readonly selected: () => Thing | undefined,
  ) {
    this.family.append(...FAMILIES.map((name) => h('option', { value: name }, name)));
    this.side.title = 'side of its black border [m]';
    const fix = h('button', { type: 'button' }, 'Fix');
    fix.addEventListener('click', () => this.errands.run('map', () => this.fix()));
    this.release.addEventListener('click', () => this.errands.run('map', () => this.letGo()));
    const field = (label: string, input: HTMLElement): HTMLElement =>
      h('label', {}, h('span', {}, label), input);
    this.element.append(
      h('summary', {}, 'Moves with a marker'),
      field('family', this.family),
      h('div', { class: 'fields' }, field('id', this.number), field('side', this.side)),
      this.moved,
      fix,
      this.release,
    );
    this.element.addEventListener('keydown', (event) => event.stopPropagation());
  }

  update(): void {
    const marker = this.selected()?.marker;
    setClass(this.release, 'hidden', marker === undefined);
    const seen = marker && this.poseOf(marker) ? 'seen' : 'not seen yet';
    setText(this.moved, marker ? `${marker.family} ${marker.id}, ${seen}` : 'It stands by itself.');
  }

  private poseOf({ family, id }: Marker): Rigid3 | undefined {
    const markers = this.session.pose?.markers ?? [];
    return markers.find((one) => one.family === family && one.id === id)?.worldFromMarker;
  }

  private placeOf(thing: Thing): Rigid3 | undefined {
    const { annotations, pose } = this.session;
    return worldFromThing(thing, (id) => annotations.get(id)?.anchor.pointInWorld, [
      ...(pose?.markers ?? []),
    ]);
  }

  private async fix(): Promise<string> {
    const thing = this.selected();
    if (!thing) throw new Error('select the thing in the list first');
    const marker = {
      family: this.family.value,
      id: this.number.valueAsNumber,
      sideM: this.side.valueAsNumber,
    };
    if (!Number.isInteger(marker.id) || !(marker.sideM > 0)) {
      throw new Error('give the number of the marker and the side of its black border in metres');
    }
    const place = this.placeOf(thing);
    if (!place) throw new Error(`nobody knows where ${thing.name} is now`);
    // The server looks for markers that something is fixed to: it is told of it first.
    await this.edits.put({ ...thing, annotationId: '', marker, parentFromObject: IDENTITY });
    const seen = await this.seen(marker);
    if (!seen) {
      await this.edits.undo();
      throw new Error(
        `${marker.family} ${marker.id} was not seen within ${SEEN_MS / 1000} s; show it to the camera`,
      );
    }
    const parentFromObject = compose(inverse(seen), place);
    await this.edits.put({ ...thing, annotationId: '', marker, parentFromObject }, true);
    return `${thing.name} moves with ${marker.family} ${marker.id}`;
  }

  private async seen(marker: Marker): Promise<Rigid3 | undefined> {
    const limit = AbortSignal.timeout(SEEN_MS);
    while (!limit.aborted) {
      const pose = this.poseOf(marker);
      if (pose) return pose;
      await sleep(STEP_MS, limit);
    }
    return undefined;
  }

  private async letGo(): Promise<string> {
    const thing = this.selected();
    const place = thing && this.placeOf(thing);
    if (!thing || !place) throw new Error('nobody knows where it is now');
    await this.edits.put({ ...thing, marker: undefined, parentFromObject: place });
    return `${thing.name} stands by itself`;
  }
}
