import type { Shape } from '../session/types';

export type ToolName = 'select' | 'area' | 'laser' | 'gaze' | 'thing' | Shape;
export type CommandName =
  | 'undo'
  | 'redo'
  | 'delete'
  | 'copy'
  | 'paste'
  | 'lock'
  | 'freeze'
  | 'swap'
  | 'follow'
  | 'frame'
  | 'reset';
/** What the head does at once, or who steers it. */
export type HeadCommandName = 'stop' | 'home' | 'level' | 'explore' | 'fast' | 'lease';

/** What happens to the marks as a whole, above their list. */
export type MarkCommandName = 'mine' | 'hide' | 'snapshot';

/** What of the place the map shows, and from where; one after the other. */
export type MapCommandName = 'show' | 'stand';

/** What keys alone do, beside the handle of the selected mark. */
export type TurnName = 'turn_left' | 'turn_right';

export interface Control<Name extends string> {
  readonly name: Name;
  readonly label: string;
  readonly key: string; // as KeyboardEvent.key, lower case; after "ctrl+" with Ctrl or Cmd
  readonly shown: string; // on the button
  readonly hint: string;
}

/** What a click in the video or the map does. One key each. */
export const TOOLS: readonly Control<ToolName>[] = [
  {
    name: 'select',
    label: 'Select',
    key: 'v',
    shown: 'V',
    hint: 'click a mark to select it, Shift for several; drag a selected one to move it',
  },
  {
    name: 'area',
    label: 'Select several',
    key: '2',
    shown: '2',
    hint: 'drag a rectangle round marks, or click one after the other',
  },
  {
    name: 'laser',
    label: 'Laser pointer',
    key: 'w',
    shown: 'W',
    hint: 'press and move: the others see where you point, until you let go',
  },
  {
    name: 'ink',
    label: 'Ink',
    key: 'i',
    shown: 'I',
    hint: 'press and draw: everybody sees the stroke grow',
  },
  {
    name: 'cube',
    label: 'Cube',
    key: 'c',
    shown: 'C',
    hint: 'click to place a cube, 5 cm where the scale is known',
  },
  {
    name: 'box',
    label: 'Box',
    key: 'b',
    shown: 'B',
    hint: 'drag from one corner to the other, or click for 10 cm',
  },
  { name: 'note', label: 'Note', key: 'n', shown: 'N', hint: 'click to place a note, then type' },
  { name: 'arrow', label: 'Arrow', key: 'a', shown: 'A', hint: 'click to place an arrow' },
  {
    name: 'pin',
    label: 'Pin',
    key: '1',
    shown: '1',
    hint: 'click to place a pin: the next number is its own',
  },
  {
    name: 'measure',
    label: 'Distance',
    key: 'd',
    shown: 'D',
    hint: 'click both ends: the length, and how sure it is',
  },
  {
    name: 'check_list',
    label: 'Check list',
    key: 'j',
    shown: 'J',
    hint: 'click its place, then write what is to be done',
  },
  {
    name: 'picture',
    label: 'Picture',
    key: 'u',
    shown: 'U',
    hint: 'click its place, then choose a picture or a page of a PDF; or drop a file there',
  },
  {
    name: 'thing',
    label: 'Things',
    key: '4',
    shown: '4',
    hint: 'furniture and machines to try: place them, push them to the wall; measure what is there',
  },
  {
    name: 'gaze',
    label: 'Look',
    key: 'g',
    shown: 'G',
    hint: 'click what the camera should look at and hold',
  },
];

/** What happens at once. */
export const COMMANDS: readonly Control<CommandName>[] = [
  { name: 'undo', label: 'Undo', key: 'z', shown: 'Z', hint: 'take back your last change' },
  { name: 'redo', label: 'Redo', key: 'y', shown: 'Y', hint: 'do it again' },
  {
    name: 'delete',
    label: 'Delete',
    key: 'delete',
    shown: 'Del',
    hint: 'delete the selected marks',
  },
  {
    name: 'copy',
    label: 'Copy',
    key: 'ctrl+c',
    shown: '^C',
    hint: 'copy the selected marks (Ctrl C)',
  },
  {
    name: 'paste',
    label: 'Paste',
    key: 'ctrl+v',
    shown: '^V',
    hint: 'put the copied marks where the pointer is, in the map or the video (Ctrl V)',
  },
  {
    name: 'lock',
    label: 'Lock',
    key: '3',
    shown: '3',
    hint: 'only you and the wearer change a locked mark; again: unlock',
  },
  {
    name: 'freeze',
    label: 'Freeze',
    key: 'p',
    shown: 'P',
    hint: 'hold the picture and click in it; again: go on',
  },
  { name: 'swap', label: 'Swap', key: 's', shown: 'S', hint: 'swap the map and the video' },
  { name: 'follow', label: 'Follow', key: 'f', shown: 'F', hint: 'keep the wearer in view' },
  {
    name: 'frame',
    label: 'Whole map',
    key: 'h',
    shown: 'H',
    hint: 'bring the whole map into view',
  },
  {
    name: 'reset',
    label: 'Reset map',
    key: 'r',
    shown: 'R',
    hint: 'forget the map and start anew',
  },
];

/** What happens to the head, on the gaze panel. */
export const HEAD_COMMANDS: readonly Control<HeadCommandName>[] = [
  { name: 'stop', label: 'Stop', key: 'x', shown: 'X', hint: 'stop the head where it is' },
  { name: 'home', label: 'Ahead', key: '0', shown: '0', hint: 'look straight ahead (home)' },
  {
    name: 'level',
    label: 'Level',
    key: 'l',
    shown: 'L',
    hint: 'keep the direction, and the picture level',
  },
  {
    name: 'explore',
    label: 'Explore',
    key: 'e',
    shown: 'E',
    hint: 'look round where the map is least certain',
  },
  { name: 'fast', label: 'Fast', key: 't', shown: 'T', hint: 'turn as fast as the head can' },
  {
    name: 'lease',
    label: 'Pilot',
    key: 'q',
    shown: 'Q',
    hint: 'take the lease of the head, wait for it, or release it',
  },
];

/** Above the list of marks. */
export const MARK_COMMANDS: readonly Control<MarkCommandName>[] = [
  { name: 'mine', label: 'Only mine', key: 'o', shown: 'O', hint: 'list and draw only your marks' },
  {
    name: 'hide',
    label: 'Hide marks',
    key: 'm',
    shown: 'M',
    hint: 'do not draw the selected marks, or any; again: all',
  },
  {
    name: 'snapshot',
    label: 'Snapshot',
    key: 'k',
    shown: 'K',
    hint: 'keep the picture with its marks as a PNG',
  },
];

/** In the map. */
export const MAP_COMMANDS: readonly Control<MapCommandName>[] = [
  {
    name: 'show',
    label: 'What the map shows',
    key: '5',
    shown: '5',
    hint: 'surfaces, surfaces and dots, or dots alone',
  },
  {
    name: 'stand',
    label: 'Where the map is seen from',
    key: '6',
    shown: '6',
    hint: 'all round; walk with W A S D or arrows, drag to look; from above; as the wearer',
  },
];

/** Of the selected arrow or box; Shift tips it towards or away instead. */
export const TURNS: readonly Control<TurnName>[] = [
  {
    name: 'turn_left',
    label: 'Turn',
    key: ',',
    shown: ',',
    hint: 'turn the selected arrow or box',
  },
  { name: 'turn_right', label: 'Turn', key: '.', shown: '.', hint: 'the other way; Shift: tip it' },
];

const NO_SHAPE: readonly ToolName[] = ['select', 'area', 'laser', 'gaze', 'thing'];

export const shapeOf = (tool: ToolName): Shape | undefined =>
  NO_SHAPE.includes(tool) ? undefined : (tool as Shape);

export interface Key {
  readonly key: string;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
  readonly shiftKey: boolean;
}

const CONTROLS = [...TOOLS, ...COMMANDS, ...HEAD_COMMANDS, ...MARK_COMMANDS, ...MAP_COMMANDS];

/** The tool or command of a key press; nothing while typing or with Alt. */
export function controlOf(
  event: Key,
): ToolName | CommandName | HeadCommandName | MarkCommandName | MapCommandName | undefined {
  const key = event.key.toLowerCase();
  if (event.altKey) return undefined;
  if (event.ctrlKey || event.metaKey) {
    if (key === 'z') return event.shiftKey ? 'redo' : 'undo';
    if (key === 'y') return 'redo';
    return CONTROLS.find((control) => control.key === `ctrl+${key}`)?.name;
  }
  if (key === 'backspace') return 'delete';
  return CONTROLS.find((control) => control.key === key)?.name;
}

/** How a key turns the selected mark: +1 or -1, in the picture's plane or towards the eye. */
export function turnOf(event: Key): { readonly sign: 1 | -1; readonly tips: boolean } | undefined {
  if (event.altKey || event.ctrlKey || event.metaKey) return undefined;
  const { key, shiftKey: tips } = event;
  if (key === ',' || key === ';' || key === '<') return { sign: -1, tips };
  return key === '.' || key === ':' || key === '>' ? { sign: 1, tips } : undefined;
}
