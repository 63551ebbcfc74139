import type { Look } from '../scene/map_view';
import type { ViewName } from '../scene/viewpoint';
import { MAP_COMMANDS, type MapCommandName } from '../tools/tools';
import { h, storage } from './dom';

const KEY = 'saccade.mapLook';
const LOOKS: readonly (readonly [Look, string])[] = [
  ['surfaces', 'Surfaces'],
  ['both', 'Surfaces and dots'],
  ['dots', 'Dots'],
];
const VIEWS: readonly (readonly [ViewName, string])[] = [
  ['orbit', 'All round'],
  ['walk', 'Walk'],
  ['above', 'From above'],
  ['wearer', 'As the wearer'],
];

export interface MapChoices {
  show(look: Look): void;
  /** False: it cannot be. */
  stand(view: ViewName): boolean;
}

/** What this person chose the last time. */
export function recallLook(): Look {
  const kept = storage().getItem(KEY);
  return LOOKS.find(([name]) => name === kept)?.[0] ?? 'surfaces';
}

export function keepLook(look: Look): void {
  try {
    storage().setItem(KEY, look);
  } catch {
    // Full: then it is asked again.
  }
}

const after = <T>(all: readonly (readonly [T, string])[], now: T): T | undefined =>
  all[(all.findIndex(([name]) => name === now) + 1) % all.length]?.[0];

export const nextLook = (look: Look): Look => after(LOOKS, look) ?? 'both';
export const nextView = (view: ViewName): ViewName => after(VIEWS, view) ?? 'orbit';

/** In the map: what of the place it shows, and from where. */
export class MapControls {
  readonly element = h('div', { class: 'map-controls' });
  private readonly looks = chooser('show', LOOKS);
  private readonly views = chooser('stand', VIEWS);

  constructor(choices: MapChoices) {
    this.element.append(this.views, this.looks);
    this.looks.addEventListener('change', () => {
      const chosen = LOOKS.find(([name]) => name === this.looks.value);
      if (chosen) choices.show(chosen[0]);
      this.looks.blur(); // keys are the page's again
    });
    this.views.addEventListener('change', () => {
      const chosen = VIEWS.find(([name]) => name === this.views.value);
      if (chosen) choices.stand(chosen[0]);
      this.views.blur();
    });
    // Nothing done here is done in the map below.
    for (const event of ['pointerdown', 'pointermove', 'pointerup', 'wheel', 'contextmenu']) {
      this.element.addEventListener(event, (each) => each.stopPropagation());
    }
  }

  update(look: Look, view: ViewName): void {
    // While a list is open it is the person's.
    if (document.activeElement !== this.looks) this.looks.value = look;
    if (document.activeElement !== this.views) this.views.value = view;
  }
}

function chooser(
  name: MapCommandName,
  choices: readonly (readonly [string, string])[],
): HTMLSelectElement {
  const { label, hint, shown } = MAP_COMMANDS.find((command) => command.name === name) ?? {
    ...{ label: name, hint: '', shown: '' },
  };
  const select = h('select', {
    ...{ 'aria-label': label, title: `${label}: ${hint} (${shown})`, 'data-control': name },
    'aria-keyshortcuts': shown,
  });
  for (const [value, words] of choices) select.append(h('option', { value }, words));
  return select;
}
