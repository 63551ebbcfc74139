import type { Thing } from '../session/scene_book';
import type { ThingDraft } from '../session/scene_edits';
import type { Session } from '../session/session';
import { DOWN, facing, turnDeg, wayInWorld } from '../tools/thing_places';
import { about } from '../tools/turn';
import type { Aim } from './aim';
import { h, setClass } from './dom';
import { ROOM_HEIGHT_M } from './thing_measure';
import type { Things } from './things';

type Field = 'wide' | 'high' | 'deep' | 'x' | 'y' | 'z' | 'turn';
const FIELDS: readonly [Field, string, string][] = [
  ['wide', 'wide', 'm, along its wall'],
  ['high', 'high', 'm'],
  ['deep', 'deep', 'm'],
  ['x', 'x', 'm, of the middle of its floor'],
  ['y', 'y', 'm, down'],
  ['z', 'z', 'm'],
  ['turn', 'turn', 'degrees about the vertical'],
];
const EYE_M = 1.6; // of whoever wears the camera, above the floor
const ROOM_M = 4;

/** What is real by its numbers: a room is added, the selected room, box or plane is changed. */
export class ThingNumbers {
  readonly element = h('details', { class: 'numbers' });
  private readonly inputs = new Map<Field, HTMLInputElement>();
  private readonly change = h('button', { type: 'button' }, 'Change');
  private shown: Thing | undefined;

  constructor(
    private readonly session: Session,
    private readonly aim: Aim,
    private readonly things: Things,
  ) {
    const grid = h('div', { class: 'fields' });
    for (const [field, label, title] of FIELDS) {
      const input = h('input', { type: 'number', step: 'any', title, required: '' });
      this.inputs.set(field, input);
      grid.append(h('label', {}, h('span', {}, label), input));
    }
    const add = h('button', { type: 'button' }, 'Add room');
    add.addEventListener('click', () => this.put(undefined));
    this.change.addEventListener('click', () => this.put(this.things.selected));
    this.element.append(h('summary', {}, 'By numbers'), grid, add, this.change);
    this.element.addEventListener('toggle', () => this.fill(this.things.selected));
    this.element.addEventListener('keydown', (event) => event.stopPropagation());
  }

  update(): void {
    const { selected } = this.things;
    const real = selected?.material === 'real' && selected.shape !== 'model';
    setClass(this.change, 'hidden', !real);
    if (this.element.open && selected !== this.shown) this.fill(selected);
  }

  /** With what the selected thing has, else with a room about the wearer. */
  private fill(thing: Thing | undefined): void {
    this.shown = thing;
    const fits = thing && thing.shape !== 'model';
    const eye = this.session.scale.eye ?? { x: 0, y: 0, z: 0 };
    const view = this.aim.view('video');
    const sizeM = fits ? thing.sizeM : { x: ROOM_M, y: ROOM_HEIGHT_M, z: ROOM_M };
    const pose = fits
      ? thing.parentFromObject
      : {
          rotation: view ? facing(wayInWorld(view, 'away')) : about(DOWN, 0),
          translation: { ...eye, y: eye.y + EYE_M },
        };
    const { x, y, z } = pose.translation;
    const values: Record<Field, number> = {
      ...{ wide: sizeM.x, high: sizeM.y, deep: sizeM.z, x, y, z, turn: turnDeg(pose) },
    };
    for (const [field, input] of this.inputs)
      input.value = String(Number(values[field].toFixed(4)));
  }

  private put(thing: Thing | undefined): void {
    const bad = [...this.inputs.values()].find((input) => !Number.isFinite(input.valueAsNumber));
    if (bad) return bad.focus();
    const value = (field: Field): number => this.inputs.get(field)?.valueAsNumber ?? 0;
    const numbers = {
      sizeM: { x: value('wide'), y: value('high'), z: value('deep') },
      parentFromObject: {
        rotation: about(DOWN, (value('turn') * Math.PI) / 180),
        translation: { x: value('x'), y: value('y'), z: value('z') },
      },
    };
    const room: ThingDraft = {
      ...{ name: 'room', shape: 'room', material: 'real', modelId: '', scale: 1 },
      ...{ annotationId: '', marker: undefined, colorRgba: 0, ...numbers },
    };
    this.things.putNumbers(thing ? { ...thing, ...numbers } : room);
  }
}
