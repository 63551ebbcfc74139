import type { MapPane } from './map_pane';

const CLICK_PX = 5;
const TURN_RAD_PER_PX = 0.006;

export interface MapGestures {
  hover(clientX: number, clientY: number): void;
  leave(): void;
  click(clientX: number, clientY: number): void;
  /** The view was moved by hand. */
  moved(): void;
}

/**
 * Orbit with one finger or the left button, pan with two fingers, the right button or Shift, zoom
 * with pinch or wheel; a press that does not move is a click.
 */
export function handleMapPointer(pane: MapPane, gestures: MapGestures): void {
  const { element } = pane;
  const down = new Map<number, { x: number; y: number }>();
  let travelled = 0;

  const release = (event: PointerEvent, click: boolean): void => {
    if (!down.delete(event.pointerId)) return;
    if (click && down.size === 0 && travelled < CLICK_PX && event.button === 0) {
      gestures.click(event.clientX, event.clientY);
    }
  };

  element.addEventListener('pointerdown', (event) => {
    element.setPointerCapture(event.pointerId);
    if (down.size === 0) travelled = 0;
    else travelled = CLICK_PX; // a second finger: no click
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  element.addEventListener('pointermove', (event) => {
    const last = down.get(event.pointerId);
    if (!last) {
      gestures.hover(event.clientX, event.clientY);
      return;
    }
    const dx = event.clientX - last.x;
    const dy = event.clientY - last.y;
    travelled += Math.hypot(dx, dy);
    const before = spread(down);
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (travelled < CLICK_PX) return;
    const { map } = pane;
    if (!map) return;
    const panning = down.size > 1 || event.shiftKey || (event.buttons & 6) !== 0;
    if (panning) {
      const unit = element.clientHeight * down.size;
      map.orbit.pan(-dx / unit, -dy / unit);
      const after = spread(down);
      if (before > 0 && after > 0) map.orbit.zoom(before / after);
    } else {
      map.orbit.rotate(dx * TURN_RAD_PER_PX, dy * TURN_RAD_PER_PX);
    }
    gestures.moved();
  });
  element.addEventListener('pointerup', (event) => release(event, true));
  element.addEventListener('pointercancel', (event) => release(event, false));
  element.addEventListener('pointerleave', () => gestures.leave());
  element.addEventListener('contextmenu', (event) => event.preventDefault());
  element.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const factor = Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.0015);
      pane.zoomAt(factor, event.clientX, event.clientY);
      gestures.moved();
    },
    { passive: false },
  );
}

/** Distance between two fingers; 0 with fewer. */
function spread(down: ReadonlyMap<number, { x: number; y: number }>): number {
  const [a, b] = [...down.values()];
  return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
}

/** A press that does not move far is a click, on the video. */
export function handleVideoPointer(
  element: HTMLElement,
  gestures: Omit<MapGestures, 'moved'> & { press(clientX: number, clientY: number): void },
): void {
  let start: { x: number; y: number } | undefined;
  element.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    start = { x: event.clientX, y: event.clientY };
    gestures.press(event.clientX, event.clientY);
  });
  element.addEventListener('pointermove', (event) => gestures.hover(event.clientX, event.clientY));
  element.addEventListener('pointerleave', () => gestures.leave());
  element.addEventListener('pointerup', (event) => {
    if (start && Math.hypot(event.clientX - start.x, event.clientY - start.y) < 2 * CLICK_PX) {
      gestures.click(event.clientX, event.clientY);
    }
    start = undefined;
  });
}
