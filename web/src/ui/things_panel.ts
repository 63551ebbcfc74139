import type { Session } from '../session/session';
import { turnDeg, type Way } from '../tools/thing_places';
import type { Aim } from './aim';
import type { AppState } from './app_state';
import { h, isTextField, setAttribute, setClass, setText } from './dom';
import { whyNotEdit } from './rights';
import { LIBRARY, SHOWN_INSIDE } from './thing_library';
import type { ThingMarker } from './thing_marker';
import { ThingNumbers } from './thing_numbers';
import { OVERLAYS } from './thing_overlays';
import { LEAST_PAIRS } from './thing_register';
import type { ThingClick, Things } from './things';

const WAYS: readonly { way: Way; key: string; shown: string }[] = [
  { way: 'left', key: 'ArrowLeft', shown: '←' },
  { way: 'away', key: 'ArrowUp', shown: '↑' },
  { way: 'nearer', key: 'ArrowDown', shown: '↓' },
  { way: 'right', key: 'ArrowRight', shown: '→' },
];
const ACTS: readonly [ThingClick, string][] = [
  ['select', 'selects a thing'],
  ['move', 'moves the selected thing there'],
  ['plane', 'marks a plane: 3 points'],
  ['box', 'marks a box: 2 corners'],
  ['room', 'marks a room: 6 points'],
  ['register', 'registers the selected: 4 points'],
];

const FLAT_M = 1e-4; // of a picture

/** Things of the scene: what a click does, what there is, where it stands, and how it is pushed. */
export class ThingsPanel {
  readonly element: HTMLElement;
  private readonly does = h('select', { 'aria-label': 'A click' });
  private readonly against = h('select', { 'aria-label': 'On' });
  private readonly file = h('input', {
    type: 'file',
    accept: '.glb,image/png,image/jpeg,image/webp',
    class: 'hidden',
  });
  private readonly said = h('p', { class: 'said', role: 'status' });
  private readonly list = h('ul', { 'aria-label': 'Things of the scene' });
  private readonly place = h('p', { class: 'place number' });
  private readonly pairs = h('ol', { 'aria-label': 'Points clicked' });
  private readonly total = h('p', { class: 'total number', role: 'status' });
  private readonly accept = h('button', { type: 'button' }, 'Accept');
  private readonly done = h('button', { type: 'button' }, 'Done');
  private readonly numbers: ThingNumbers;
  private readonly marker: ThingMarker;
  private readonly moves = h('div', { class: 'moves', role: 'group' });
  private listed = '';
  private optioned = '';

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly things: Things,
    aim: Aim,
  ) {
    this.numbers = new ThingNumbers(session, aim, things);
    this.marker = things.marker;
    const open = this.button('File…', () => this.file.click());
    this.against.append(
      h('option', { value: 'floor' }, 'floor'),
      h('option', { value: 'wall' }, 'wall'),
    );
    this.addMoves();
    this.element = h(
      'section',
      { class: 'things hidden', 'aria-label': 'Things' },
      h('h2', {}, 'Things'),
      h('label', {}, h('span', {}, 'A click'), this.does),
      h('label', {}, h('span', {}, 'On the'), this.against, open),
      this.file,
      this.said,
      this.done,
      this.pairs,
      this.total,
      this.accept,
      this.list,
      this.place,
      this.moves,
      this.numbers.element,
      this.marker.element,
    );
    this.listen();
  }

  private button(text: string, act: () => void, label = text): HTMLButtonElement {
    const button = h('button', { type: 'button', 'aria-label': label }, text);
    button.addEventListener('click', act);
    return button;
  }

  private addMoves(): void {
    const { things, moves } = this;
    moves.setAttribute('aria-label', 'Push, turn, delete the selected thing');
    for (const { way, shown, key } of WAYS) {
      const button = this.button(shown, () => things.moves.push(way), `Push ${way}`);
      button.setAttribute('aria-keyshortcuts', key);
      button.title = `push it ${way} until it touches; then it is lowered until it rests`;
      moves.append(button);
    }
    moves.append(
      this.button('↺', () => things.moves.turn(-1), 'Turn left'),
      this.button('↻', () => things.moves.turn(1), 'Turn right'),
      this.button('Delete', () => things.moves.remove()),
      this.button('Undo', () => things.undo()),
    );
  }

  private listen(): void {
    const { things, does, against, file, accept } = this;
    does.addEventListener('change', () => things.choose(does.value as ThingClick));
    against.addEventListener('change', () => {
      things.against = against.value === 'wall' ? 'wall' : 'floor';
      things.choose(things.clickDoes);
    });
    file.addEventListener('change', () => {
      const [chosen] = file.files ?? [];
      if (chosen) things.take(this.state.main, undefined, chosen);
      file.value = '';
    });
    accept.addEventListener('click', () => things.accept());
    this.done.addEventListener('click', () => things.finish());
    this.element.addEventListener('keydown', (event) => {
      const way = WAYS.find(({ key }) => key === event.key)?.way;
      if (!way || isTextField(event.target)) return;
      event.preventDefault();
      if (!event.repeat) things.moves.push(way);
    });
  }

  focus(): void {
    this.does.focus();
  }

  update(): void {
    const { session, state, things } = this;
    const shown = state.tool === 'thing';
    setClass(this.element, 'hidden', !shown);
    if (!shown) return;
    const why = whyNotEdit(session);
    this.updateChoices();
    if (this.does.value !== things.clickDoes) this.does.value = things.clickDoes;
    setClass(this.done, 'hidden', !things.hasWay);
    this.numbers.update();
    this.marker.update();
    setText(this.said, why ?? things.said.text);
    setClass(this.said, 'warn', why !== undefined || things.said.warn);
    this.updateList();
    this.updatePlace();
    this.updateRegister();
    for (const button of this.element.querySelectorAll('.moves button')) {
      setAttribute(button as HTMLElement, 'aria-disabled', String(why !== undefined));
    }
  }

  private updateChoices(): void {
    const { models } = this.session.scene;
    const key = models.map(({ id }) => id).join();
    if (key === this.optioned && this.does.options.length > 0) return;
    this.optioned = key;
    const option = (value: string, text: string): HTMLElement => h('option', { value }, text);
    const library = h('optgroup', { label: 'Places, of the library' });
    library.append(...LIBRARY.map((name) => option(`library ${name}`, `places a ${name}`)));
    const laid = h('optgroup', { label: 'Explains' });
    laid.append(...OVERLAYS.map(([kind, text]) => option(kind, text)));
    laid.append(
      ...SHOWN_INSIDE.map((name) => option(`inside ${name}`, `shows a cabinet's ${name}`)),
      ...models
        .filter(({ sizeM }) => sizeM.z < FLAT_M)
        .map(({ id, name }) => option(`inside ${id}`, `shows ${name}`)),
    );
    const built = [...LIBRARY, ...SHOWN_INSIDE, ...OVERLAYS.map(([kind]) => kind)] as string[];
    const own = models.filter(({ name, sizeM }) => sizeM.z >= FLAT_M && !built.includes(name));
    const uploaded = h('optgroup', { label: 'Places, of this server' });
    uploaded.append(...own.map(({ id, name }) => option(`model ${id}`, `places ${name}`)));
    const acts = ACTS.map(([value, text]) => option(value, text));
    this.does.replaceChildren(...acts, library, laid);
    if (own.length > 0) this.does.append(uploaded);
  }

  private updateList(): void {
    const { things: all } = this.session.scene;
    const key = all.map(({ id, name, material }) => `${id} ${name} ${material}`).join();
    if (key !== this.listed) {
      this.listed = key;
      const rows = all.map(({ id, name, material }) => {
        const button = this.button(`${name} · ${material}`, () => this.things.select(id));
        button.dataset['id'] = id;
        return h('li', {}, button);
      });
      const none = h('li', { class: 'none' }, 'Nothing yet: measure the room, or place a thing.');
      this.list.replaceChildren(...(rows.length > 0 ? rows : [none]));
    }
    for (const button of this.list.querySelectorAll('button')) {
      const selected = button.dataset['id'] === this.state.thingId;
      setAttribute(button, 'aria-pressed', String(selected));
      setClass(button, 'current', selected);
    }
  }

  private updatePlace(): void {
    const thing = this.things.selected;
    if (!thing) return setText(this.place, 'Select a thing to read its place.');
    const { x, y, z } = thing.parentFromObject.translation;
    const unit = this.session.scale.metric ? 'm' : 'units of the map';
    const turn = `turn ${turnDeg(thing.parentFromObject).toFixed(1)}°`;
    const at = (
      [
        ['x', x],
        ['y', y],
        ['z', z],
      ] as const
    )
      .map(([axis, value]) => `${axis} ${(Math.abs(value) < 5e-5 ? 0 : value).toFixed(4)}`)
      .join('  ');
    const on = thing.marker ? ` on ${thing.marker.family} ${thing.marker.id}` : '';
    setText(this.place, `${thing.name}${on}: ${at} ${unit}, ${turn}`);
  }

  private updateRegister(): void {
    const { register } = this.things;
    const { pairs, result, why, thing } = register;
    setClass(this.accept, 'hidden', result === undefined);
    setClass(this.pairs, 'hidden', thing === undefined);
    setClass(this.total, 'hidden', thing === undefined);
    if (!thing) return;
    const texts = pairs.map((_, i) => {
      const own = result?.errorsMm[i];
      const others = result?.leftOutErrorsMm[i];
      if (own === undefined || others === undefined) return 'clicked';
      return `${own.toFixed(1)} mm, by the others ${others.toFixed(1)} mm`;
    });
    const key = texts.join('|');
    if (this.pairs.dataset['key'] !== key) {
      this.pairs.dataset['key'] = key;
      this.pairs.replaceChildren(
        ...texts.map((text, i) =>
          h(
            'li',
            {},
            h('span', {}, text),
            this.button('×', () => this.drop(i), `Drop point ${i + 1}`),
          ),
        ),
      );
    }
    const missing = LEAST_PAIRS - pairs.length;
    const words = result
      ? `error ${result.rmsMm.toFixed(1)} mm; to expect elsewhere ${result.leftOutRmsMm.toFixed(1)} mm`
      : why || `${missing} more ${missing === 1 ? 'point' : 'points'}`;
    setText(this.total, words);
  }

  private drop(index: number): void {
    void this.things.register.drop(index).then(() => this.state.changed());
  }
}
