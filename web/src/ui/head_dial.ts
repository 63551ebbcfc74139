import type { HeadAngles } from '../session/gaze';

const SVG = 'http://www.w3.org/2000/svg';

/** The head from above: up is the wearer's straight ahead, the wedge is where the camera looks. */
export class HeadDial {
  readonly element = shape('svg', {
    viewBox: '-20 -20 40 40',
    class: 'dial',
    'aria-hidden': 'true',
  });
  private readonly wedge = shape('path', { d: 'M0 0L-8.5-15.5A17.7 17.7 0 018.5-15.5z' });

  constructor() {
    this.element.append(
      shape('circle', { r: '18' }),
      shape('path', { class: 'ahead', d: 'M0-18v-2' }),
      this.wedge,
    );
  }

  update(angles: HeadAngles | undefined): void {
    this.element.classList.toggle('hidden', !angles);
    if (!angles) return;
    const turn = ((angles.pan * 180) / Math.PI).toFixed(1);
    if (this.wedge.getAttribute('data-turn') === turn) return;
    this.wedge.setAttribute('data-turn', turn);
    this.wedge.setAttribute('transform', `rotate(${turn})`);
  }
}

function shape(tag: string, attributes: Record<string, string>): SVGElement {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}
