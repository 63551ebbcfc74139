import {
  type CommandName,
  controlOf,
  HEAD_COMMANDS,
  type HeadCommandName,
  MAP_COMMANDS,
  type MapCommandName,
  MARK_COMMANDS,
  type MarkCommandName,
  type ToolName,
  TOOLS,
  turnOf,
} from '../tools/tools';
import type { Controller } from './controller';
import { isComposing, isTextField } from './dom';
import type { GazeController } from './gaze_controller';
import type { Help } from './help';
import type { MapPane } from './map_pane';
import type { VideoPane } from './video_pane';

const TURN_RAD = 0.12;

type Name = ToolName | CommandName | HeadCommandName | MarkCommandName | MapCommandName;
const isTool = (name: Name): name is ToolName => TOOLS.some((tool) => tool.name === name);
const isHeadCommand = (name: Name): name is HeadCommandName =>
  HEAD_COMMANDS.some((command) => command.name === name);
const isMarkCommand = (name: Name): name is MarkCommandName =>
  MARK_COMMANDS.some((command) => command.name === name);
const isMapCommand = (name: Name): name is MapCommandName =>
  MAP_COMMANDS.some((command) => command.name === name);

/** Everything the pointer does, by key. */
export function handleKeys(
  controller: Controller,
  gaze: GazeController,
  map: MapPane,
  video: VideoPane,
  help: Help,
  find: () => void,
): void {
  document.addEventListener('keydown', (event) => {
    if (isTextField(event.target) || isComposing(event) || isAsking()) return;
    const turn = turnOf(event);
    if (turn && controller.turn(turn.sign, turn.tips)) event.preventDefault();
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === 'a') {
      event.preventDefault();
      controller.selectAll();
    }
    const name = controlOf(event);
    // What is marked as text is what is copied then.
    if (name === 'copy' && !getSelection()?.isCollapsed) return;
    if (event.key === '?') help.toggle();
    if (event.key === 'Escape') controller.escape();
    if (event.key === 'F2') controller.editSelected();
    if (event.key === '/' && !event.ctrlKey && !event.metaKey && !event.altKey) {
      event.preventDefault();
      find();
    }
    if (!name) return;
    event.preventDefault();
    if (event.repeat && isHeadCommand(name)) return;
    if (isTool(name)) controller.choose(name);
    else if (isHeadCommand(name)) gaze.run(name);
    else if (isMarkCommand(name)) controller.runMarks(name);
    else if (isMapCommand(name)) map.next(name);
    else controller.run(name);
  });
  map.element.addEventListener('keydown', (event) => {
    if (event.target !== map.element || !moveMap(event, map, controller)) return;
    event.preventDefault();
  });
  video.element.addEventListener('keydown', (event) => {
    if (event.target !== video.element) return;
    if (event.key === 'Enter') {
      event.preventDefault(); // it is not the first line of a note that this opens
      if (!event.repeat) controller.hand.keyPress('video', event.shiftKey);
    } else if (moveCursor(event, controller)) {
      event.preventDefault();
    }
  });
}

const STEP = 0.01; // of the picture
const LONG_STEP = 0.06;

/** The keyboard's place in the video. */
function moveCursor({ key, shiftKey }: KeyboardEvent, { hand }: Controller): boolean {
  const step = shiftKey ? LONG_STEP : STEP;
  const [dx, dy] = ARROWS[key] ?? [0, 0];
  if (dx === 0 && dy === 0) return false;
  hand.moveCursor(dx * step, dy * step);
  return true;
}

const ARROWS: Partial<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** A dialog has the keyboard. */
const isAsking = (): boolean => document.querySelector('dialog[open]') !== null;

function moveMap(event: KeyboardEvent, pane: MapPane, controller: Controller): boolean {
  const { map } = pane;
  if (!map) return false;
  const pan = event.shiftKey;
  switch (event.key) {
    case 'ArrowLeft':
      if (pan) map.eye.pan(-0.05, 0);
      else map.eye.rotate(-TURN_RAD, 0);
      break;
    case 'ArrowRight':
      if (pan) map.eye.pan(0.05, 0);
      else map.eye.rotate(TURN_RAD, 0);
      break;
    case 'ArrowUp':
      if (pan) map.eye.pan(0, -0.05);
      else map.eye.rotate(0, TURN_RAD);
      break;
    case 'ArrowDown':
      if (pan) map.eye.pan(0, 0.05);
      else map.eye.rotate(0, -TURN_RAD);
      break;
    case '+':
    case '=':
      map.eye.zoom(0.85);
      break;
    case '-':
      map.eye.zoom(1 / 0.85);
      break;
    case 'Enter':
      if (!event.repeat) controller.hand.keyPress('map', event.shiftKey);
      return true;
    default:
      return false;
  }
  map.hold();
  requestAnimationFrame(() => controller.hand.keyMoved('map')); // once it is drawn from there
  return true;
}
