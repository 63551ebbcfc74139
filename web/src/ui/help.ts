import { COMMANDS, HEAD_COMMANDS, MAP_COMMANDS, MARK_COMMANDS, TOOLS, TURNS } from '../tools/tools';
import { FEATURE_CSS, TARGET_CSS } from '../scene/feature_css';
import type { FeatureState } from '../session/types';
import { h } from './dom';
import { TALK_KEYS } from './talk_keys';

const LEGEND: readonly [FeatureState, string, string][] = [
  ['measured', '●', 'measured in this picture'],
  ['failed', '✕', 'searched for, not found'],
  ['not_attempted', '○', 'not searched for in this picture: drawn where the map has it'],
];

/** What the keys do and what the colours mean, as a sheet over the page. */
export class Help {
  readonly button = h(
    'button',
    { type: 'button', class: 'help', 'aria-label': 'Help', title: 'Help (?)' },
    '?',
  );
  readonly dialog: HTMLDialogElement;
  /** Begins the first task once more. */
  onFirstTask: (() => void) | undefined;
  /** Shows the maps that are kept; the bottom line, which has a button for it, is not everywhere. */
  onMaps: (() => void) | undefined;

  constructor() {
    const keys = h('dl', {});
    for (const { label, shown, hint } of [
      ...TOOLS,
      ...COMMANDS,
      ...TURNS,
      ...HEAD_COMMANDS,
      ...MARK_COMMANDS,
      ...MAP_COMMANDS,
    ]) {
      keys.append(h('dt', {}, h('kbd', {}, shown), label), h('dd', {}, hint));
    }
    keys.append(
      h('dt', {}, h('kbd', {}, '/'), 'Find'),
      h('dd', {}, 'find marks by text, shape, author'),
      h('dt', {}, h('kbd', {}, '^A'), 'All'),
      h('dd', {}, 'select all marks that are drawn'),
      h('dt', {}, h('kbd', {}, 'F2'), 'Words'),
      h('dd', {}, 'change the words of the selected mark; or double-click its row'),
      h('dt', {}, h('kbd', {}, 'Esc'), 'Give up'),
      h('dd', {}, 'what is under way, then the tool, then the selection'),
    );
    for (const { shown, label, hint } of TALK_KEYS) {
      keys.append(h('dt', {}, h('kbd', {}, shown), label), h('dd', {}, hint));
    }
    const legend = h('ul', { class: 'legend' });
    const explain = (colour: string, sign: string, words: string): void => {
      const mark = h('span', { class: 'sign' }, sign);
      mark.style.color = colour;
      legend.append(h('li', {}, mark, words));
    };
    for (const [state, sign, words] of LEGEND) explain(FEATURE_CSS[state], sign, words);
    explain(TARGET_CSS, '◎', 'what the camera is to look at; its ring is solid once it is held');
    const close = h('button', { type: 'button' }, 'Close');
    close.addEventListener('click', () => this.dialog.close());
    const task = h('button', { type: 'button' }, 'Show the first task');
    task.addEventListener('click', () => {
      this.dialog.close();
      this.onFirstTask?.();
    });
    const maps = h('button', { type: 'button' }, 'Maps that are kept');
    maps.addEventListener('click', () => {
      this.dialog.close();
      this.onMaps?.();
    });
    this.dialog = h(
      'dialog',
      { 'aria-label': 'Help' },
      h('h2', {}, 'Keys'),
      keys,
      h('h2', {}, 'Features'),
      legend,
      h('h2', {}, 'By hand'),
      h(
        'p',
        {},
        'Drag to orbit, right-drag or Shift-drag to pan, wheel to zoom; on a touch screen one finger, two fingers, pinch. Where you walk in the map: drag to look, W A S D or two fingers to go, wheel or pinch to go ahead. With the map focused: arrow keys orbit (or walk and turn), plus and minus zoom, Enter clicks in the middle. With the video focused: arrow keys move the place that Enter clicks at. Tools that are pressed and moved are held from one Enter to the next.',
      ),
      task,
      maps,
      close,
    );
    this.button.addEventListener('click', () => this.toggle());
  }

  toggle(): void {
    if (this.dialog.open) this.dialog.close();
    else this.dialog.showModal();
  }
}
