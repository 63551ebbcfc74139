import { FAMILIES, kindOf, KINDS, targetText } from './calibrate_words';
import { h, setClass, setText } from './dom';

/** What is held before the camera, asked for field by field. */
export class CalibrateForm {
  readonly element: HTMLFormElement;
  private readonly kind = select(KINDS.map(({ kind, name }) => [kind, name]));
  private readonly columns = field('numeric');
  private readonly rows = field('numeric');
  private readonly side = field('decimal');
  private readonly second = field('decimal');
  private readonly family = select(FAMILIES.map((name) => [name, name]));
  private readonly lens = select([
    ['', 'whichever explains more'],
    ['brown_conrady', 'ordinary (brown_conrady)'],
    ['kannala_brandt', 'fisheye (kannala_brandt)'],
  ]);
  private readonly counted = h('legend');
  private readonly sideLabel = h('span');
  private readonly secondLabel = h('span');
  private readonly secondRow: HTMLLabelElement;
  private readonly familyRow: HTMLLabelElement;
  readonly begin = h('button', { type: 'submit', class: 'main' }, 'Start');

  constructor(start: (target: string, lens: string) => void) {
    this.secondRow = h('label', {}, this.secondLabel, this.second);
    this.familyRow = h('label', {}, h('span', {}, 'Family of the markers'), this.family);
    this.element = h(
      'form',
      { novalidate: '' },
      h('label', {}, h('span', {}, 'Target'), this.kind),
      h(
        'fieldset',
        {},
        this.counted,
        h('label', {}, h('span', {}, 'across'), this.columns),
        h('label', {}, h('span', {}, 'down'), this.rows),
      ),
      h('label', {}, this.sideLabel, this.side),
      this.secondRow,
      this.familyRow,
      h('label', {}, h('span', {}, 'Lens'), this.lens),
      this.begin,
    );
    this.kind.addEventListener('change', () => this.fill());
    this.element.addEventListener('submit', (event) => {
      event.preventDefault();
      start(this.target, this.lens.value);
    });
    this.fill();
  }

  get target(): string {
    return targetText({
      kind: this.kind.value,
      columns: this.columns.value,
      rows: this.rows.value,
      side: this.side.value,
      second: this.second.value,
      family: this.family.value,
    });
  }

  private fill(): void {
    const kind = kindOf(this.kind.value);
    this.columns.value = kind.start.columns;
    this.rows.value = kind.start.rows;
    this.side.value = kind.start.side;
    this.second.value = kind.start.second;
    if (kind.families) this.family.value = kind.start.family;
    setText(this.counted, `How many ${kind.counted}`);
    setText(this.sideLabel, kind.side);
    setText(this.secondLabel, kind.second ?? '');
    setClass(this.secondRow, 'hidden', kind.second === undefined);
    setClass(this.familyRow, 'hidden', !kind.families);
  }
}

const field = (inputmode: string): HTMLInputElement =>
  h('input', { type: 'text', inputmode, autocomplete: 'off', required: '' });

const select = (options: readonly (readonly [string, string])[]): HTMLSelectElement =>
  h('select', {}, ...options.map(([value, name]) => h('option', { value }, name)));
