import type { Shape } from '../session/types';

export type ToolName = 'select' | 'cube' | 'note' | 'arrow' | 'gaze';
export type CommandName =
  | 'undo'
  | 'redo'
  | 'delete'
  | 'freeze'
  | 'swap'
  | 'follow'
  | 'frame'
  | 'reset';
/** What the head does at once, or who steers it. */
export type HeadCommandName = 'stop' | 'home' | 'level' | 'explore' | 'fast' | 'lease';

/** What happens to the marks as a whole, above their list. */
export type MarkCommandName = 'mine' | 'hide' | 'snapshot';

export interface Control<Name extends string> {
  readonly name: Name;
  readonly label: string;
  readonly key: string; // as KeyboardEvent.key, lower case
  readonly shown: string; // on the button
  readonly hint: string;
}

/** What a click in the video or the map does. One key each. */
export const TOOLS: readonly Control<ToolName>[] = [
  { name: 'select', label: 'Select', key: 'v', shown: 'V', hint: 'click a mark to select it' },
  {
    name: 'cube',
    label: 'Cube',
    key: 'c',
    shown: 'C',
    hint: 'click to place a cube, 5 cm where the scale is known',
  },
  { name: 'note', label: 'Note', key: 'n', shown: 'N', hint: 'click to place a note, then type' },
  { name: 'arrow', label: 'Arrow', key: 'a', shown: 'A', hint: 'click to place an arrow' },
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
    hint: 'delete the selected mark',
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
  { name: 'hide', label: 'Hide marks', key: 'm', shown: 'M', hint: 'draw no marks; again: all' },
  {
    name: 'snapshot',
    label: 'Snapshot',
    key: 'k',
    shown: 'K',
    hint: 'keep the picture with its marks as a PNG',
  },
];

export const shapeOf = (tool: ToolName): Shape | undefined =>
  tool === 'select' || tool === 'gaze' ? undefined : tool;

/** The tool or command of a key press; nothing while typing or with Ctrl, Alt, Meta. */
export function controlOf(event: {
  readonly key: string;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
  readonly shiftKey: boolean;
}): ToolName | CommandName | HeadCommandName | MarkCommandName | undefined {
  const key = event.key.toLowerCase();
  if (event.altKey) return undefined;
  if (event.ctrlKey || event.metaKey) {
    if (key === 'z') return event.shiftKey ? 'redo' : 'undo';
    return key === 'y' ? 'redo' : undefined;
  }
  if (key === 'backspace') return 'delete';
  return [...TOOLS, ...COMMANDS, ...HEAD_COMMANDS, ...MARK_COMMANDS].find(
    (control) => control.key === key,
  )?.name;
}
