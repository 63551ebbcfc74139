import { h, setClass } from './dom';

// None of the features' four colours, nor the accent.
const COLOURS = [
  [0xffffffff, 'white'],
  [0xff9a3dff, 'orange'],
  [0xff8ad8ff, 'pink'],
  [0xd9b38cff, 'tan'],
  [0x9fe7e7ff, 'pale cyan'],
] as const;

const cssOf = (rgba: number): string => `#${(rgba >>> 8).toString(16).padStart(6, '0')}`;

/** The colour of new marks, and of the selected one. */
export class Palette {
  readonly element = h('div', { class: 'palette', role: 'group', 'aria-label': 'Colour of marks' });
  private readonly buttons = new Map<number, HTMLButtonElement>();
  private readonly own = h('input', {
    type: 'color',
    'aria-label': 'Another colour',
    title: 'another colour, for new marks and the selected one',
  });
  private shown = -1;

  constructor(choose: (colorRgba: number) => void) {
    for (const [rgba, name] of COLOURS) {
      const button = h('button', {
        type: 'button',
        'aria-label': name,
        title: `${name}, for new marks and the selected one`,
      });
      button.style.setProperty('--mark', cssOf(rgba));
      button.addEventListener('click', () => choose(rgba));
      this.buttons.set(rgba, button);
    }
    this.own.addEventListener('change', () => {
      choose(((parseInt(this.own.value.slice(1), 16) << 8) | 0xff) >>> 0);
      this.own.blur(); // keys are tools again
    });
    this.element.append(...this.buttons.values(), this.own);
  }

  update(colorRgba: number): void {
    if (colorRgba === this.shown) return;
    this.shown = colorRgba;
    for (const [rgba, button] of this.buttons) {
      setClass(button, 'current', rgba === colorRgba);
      button.setAttribute('aria-pressed', String(rgba === colorRgba));
    }
    this.own.value = cssOf(colorRgba);
    setClass(this.own, 'current', !this.buttons.has(colorRgba));
  }
}
