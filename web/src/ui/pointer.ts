import type { Drag } from './drag';
import type { Press } from './grips';
import type { MapPane } from './map_pane';

const CLICK_PX = 5;
const TURN_RAD_PER_PX = 0.006;

export interface PaneGestures {
  hover(clientX: number, clientY: number): void;
  leave(): void;
  /** What a press begins beside a click; undefined: nothing. */
  grab(press: Press): Drag | undefined;
  /** What was grabbed is no longer held. */
  let(): void;
  /** False once it was given up, by a key. */
  holding(): boolean;
  press(clientX: number, clientY: number): void;
  /** `adds`: with Shift. */
  click(clientX: number, clientY: number, adds: boolean): void;
  /** The view was moved by hand. */
  moved(): void;
}

/** One pointer that holds a drag. */
class Held {
  private readonly start: { readonly x: number; readonly y: number };
  private travelled = 0;

  constructor(
    readonly pointerId: number,
    private readonly drag: Drag,
    event: PointerEvent,
  ) {
    this.start = { x: event.clientX, y: event.clientY };
  }

  get prompt(): boolean {
    return this.drag.prompt === true;
  }

  move({ clientX: x, clientY: y }: PointerEvent): void {
    this.travelled = Math.max(this.travelled, Math.hypot(x - this.start.x, y - this.start.y));
    if (!this.drag.clicks || this.travelled >= CLICK_PX) this.drag.move(x, y);
  }

  /** True where it was no more than a click. */
  release({ clientX: x, clientY: y, type }: PointerEvent): boolean {
    const click = this.drag.clicks && this.travelled < CLICK_PX;
    if (click || type !== 'pointerup') this.drag.cancel();
    else this.drag.end(x, y);
    return click && type === 'pointerup';
  }

  cancel(): void {
    this.drag.cancel();
  }
}

/**
 * Drags of tools go before everything else a press may mean in a pane. A second finger gives the drag up, and
 * both then are what they are without it.
 */
function handleDrags(
  element: HTMLElement,
  gestures: PaneGestures,
  adopt: (pointerId: number, x: number, y: number) => void,
): void {
  let held: Held | undefined;
  let last = { x: 0, y: 0 };
  const mine = (event: PointerEvent): boolean => {
    if (held?.pointerId !== event.pointerId) return false;
    event.stopImmediatePropagation();
    last = { x: event.clientX, y: event.clientY };
    return true;
  };
  const release = (event: PointerEvent): void => {
    if (!held || !mine(event)) return;
    const click = gestures.holding() && held.release(event);
    held = undefined;
    gestures.let();
    if (click) gestures.click(event.clientX, event.clientY, event.shiftKey);
  };
  element.addEventListener('pointerdown', (event) => {
    if (held) {
      held.cancel();
      gestures.let();
      adopt(held.pointerId, last.x, last.y);
      held = undefined;
      return;
    }
    if (event.button !== 0) return;
    const { clientX: x, clientY: y, shiftKey: shift } = event;
    gestures.press(x, y);
    const drag = gestures.grab({ x, y, shift, ctrl: event.ctrlKey || event.metaKey });
    if (!drag) return;
    element.setPointerCapture(event.pointerId);
    held = new Held(event.pointerId, drag, event);
    mine(event);
  });
  element.addEventListener('pointermove', (event) => {
    if (held && mine(event) && gestures.holding()) held.move(event);
  });
  // Of a slow page frames are far apart; browsers without this event have the frame's.
  element.addEventListener('pointerrawupdate', (event) => {
    if (!(event instanceof PointerEvent) || !held?.prompt) return;
    if (mine(event) && gestures.holding()) held.move(event);
  });
  element.addEventListener('pointerup', release);
  element.addEventListener('pointercancel', release);
}

/**
 * Orbit with one finger or the left button, pan with two fingers, the right button or Shift, zoom
 * with pinch or wheel; a press that does not move is a click.
 */
export function handleMapPointer(pane: MapPane, gestures: PaneGestures): void {
  const { element } = pane;
  const down = new Map<number, { x: number; y: number }>();
  let travelled = 0;

  handleDrags(element, gestures, (pointerId, x, y) => {
    down.set(pointerId, { x, y });
    travelled = CLICK_PX;
  });
  const release = (event: PointerEvent, click: boolean): void => {
    if (!down.delete(event.pointerId)) return;
    if (click && down.size === 0 && travelled < CLICK_PX && event.button === 0) {
      gestures.click(event.clientX, event.clientY, event.shiftKey);
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
      map.eye.pan(-dx / unit, -dy / unit);
      const after = spread(down);
      if (before > 0 && after > 0) map.eye.zoom(before / after);
    } else {
      // What was taken hold of stays under the pointer where one looks round.
      const perPx = map.eye.turnsHead ? 1 / map.view().camera.intrinsics.fx : TURN_RAD_PER_PX;
      map.eye.rotate(dx * perPx, dy * perPx);
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
export function handleVideoPointer(element: HTMLElement, gestures: PaneGestures): void {
  let start: { x: number; y: number } | undefined;
  handleDrags(element, gestures, () => undefined);
  element.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    start = { x: event.clientX, y: event.clientY };
  });
  element.addEventListener('pointermove', (event) => gestures.hover(event.clientX, event.clientY));
  element.addEventListener('pointerleave', () => gestures.leave());
  element.addEventListener('pointerup', (event) => {
    if (start && Math.hypot(event.clientX - start.x, event.clientY - start.y) < 2 * CLICK_PX) {
      gestures.click(event.clientX, event.clientY, event.shiftKey);
    }
    start = undefined;
  });
}

/** A file that is dropped on a pane. */
export function handleDrop(
  element: HTMLElement,
  drop: (clientX: number, clientY: number, file: File) => void,
): void {
  const over = (event: DragEvent): void => {
    if (!event.dataTransfer?.types.includes('Files')) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
    element.classList.add('takes');
  };
  element.addEventListener('dragenter', over);
  element.addEventListener('dragover', over);
  element.addEventListener('dragleave', () => element.classList.remove('takes'));
  element.addEventListener('drop', (event) => {
    element.classList.remove('takes');
    const [file] = event.dataTransfer?.files ?? [];
    if (!file) return;
    event.preventDefault(); // or the browser would leave the page for it
    drop(event.clientX, event.clientY, file);
  });
}
