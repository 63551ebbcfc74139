import { isComposing, isTextField } from './dom';
import type { MapPane } from './map_pane';

const WAYS: Partial<Record<string, readonly [right: number, forward: number]>> = {
  w: [0, 1],
  s: [0, -1],
  a: [-1, 0],
  d: [1, 0],
  arrowup: [0, 1],
  arrowdown: [0, -1],
};

/**
 * Keys that are held walk: W, A, S, D and the arrows up and down. While one walks they are no tools' keys, so this
 * is to hear of them first.
 */
export function handleWalking(pane: MapPane): void {
  const held = new Set<string>();
  const stride = (): void => {
    const ways = [...held].map((key) => WAYS[key] ?? [0, 0]);
    const sum = (i: 0 | 1): number =>
      Math.max(
        -1,
        Math.min(
          1,
          ways.reduce((all, way) => all + way[i], 0),
        ),
      );
    if (pane.map) pane.map.eye.stride = { right: sum(0), forward: sum(1) };
  };
  const release = (): void => {
    held.clear();
    stride();
  };
  const isMine = (event: KeyboardEvent): boolean => {
    if (pane.map?.eye.view !== 'walk' || pane.state.main !== 'map') return false;
    if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return false;
    if (isTextField(event.target) || isComposing(event)) return false;
    if (document.querySelector('dialog[open]')) return false;
    const key = event.key.toLowerCase();
    // Arrows belong to whatever has the keyboard.
    if (key.startsWith('arrow') && event.target !== pane.element && event.target !== document.body)
      return false;
    return key in WAYS;
  };
  document.addEventListener(
    'keydown',
    (event) => {
      if (!isMine(event)) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      held.add(event.key.toLowerCase());
      stride();
    },
    { capture: true },
  );
  document.addEventListener('keyup', ({ key }) => {
    if (held.delete(key.toLowerCase())) stride();
  });
  window.addEventListener('blur', release);
}
