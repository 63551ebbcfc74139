import type { CommandName, HeadCommandName, MarkCommandName, ToolName } from '../tools/tools';

/** Line drawings on a 20 x 20 field. */
export const ICONS: Record<
  ToolName | CommandName | HeadCommandName | MarkCommandName | 'help',
  string
> = {
  select: 'M5 3l10 7-4.5.8 2.6 4.7-2 1.1-2.6-4.7L5 15z',
  area: 'M3 5V3h2M8 3h4M15 3h2v2M17 8v4M17 15v2h-2M12 17H8M5 17H3v-2M3 12V8M8 8h4v4H8z',
  laser:
    'M3.5 16.5l7-7M13.5 6.5a1.2 1.2 0 10.01 0M13.5 1.8v1.6M18.2 6.5h-1.6M16.8 3.2l-1.1 1.1M10.2 3.2l1.1 1.1M16.8 9.8l-1.1-1.1',
  ink: 'M3 17l1-4L14 3l3 3L7 16zM12 5l3 3M3.5 17c3 1 5-1 8 0',
  box: 'M3 7h10v10H3zM7 3h10v10M3 7l4-4M13 7l4-4M13 17l4-4',
  pin: 'M10 18l-4.5-7.5a5.2 5.2 0 119 0zM9 6.2L10.4 5v5',
  measure: 'M3 14L14 3M1.5 12.5l3 3M12.5 1.5l3 3M6.5 17h11M6.5 15.2v3.6M17.5 15.2v3.6',
  check_list:
    'M3 4.5l1.5 1.5L7 3M3 10l1.5 1.5L7 8.500M3 15.500l1.500 1.500L7 14M10 5h7M10 10.500h7M10 16h7',
  picture:
    'M2.5 4h15v12h-15zM2.500 13.500l4-4 3.500 3.500 3-3 4.500 4.500M13 7.200a1.200 1.200 0 10.010 0',
  copy: 'M7 7h9.500v9.500H7zM13 7V3.500H3.500V13H7',
  paste: 'M6.500 4.500H4v12h12v-12h-2.500M7 3h6v3.500H7zM10 9v5M7.500 11.500H12.500',
  lock: 'M4.500 9h11v8h-11zM7 9V6.500a3 3 0 016 0V9M10 12v2',
  cube: 'M10 2.5l6.5 3.7v7.6L10 17.5l-6.5-3.7V6.2zM3.5 6.2L10 10l6.5-3.8M10 10v7.5',
  note: 'M3.5 3.5h13v9h-7l-3.5 4v-4h-2.5zM6.5 6.5h7M6.5 9.5h4.5',
  arrow: 'M10 2.5v14M5.5 12l4.5 4.5 4.5-4.5',
  thing: 'M4 3v14M16 3v14M4 5h12M4 10h12M4 15h12',
  gaze: 'M2 10s3-5 8-5 8 5 8 5-3 5-8 5-8-5-8-5zM10 7.5a2.5 2.5 0 100 5 2.5 2.5 0 000-5z',
  stop: 'M5.5 5.5h9v9h-9z',
  home: 'M10 16.5v-12M5.5 9L10 4.5 14.5 9',
  level: 'M2.5 10h15M6 6.5v7M14 6.5v7',
  explore: 'M9 3.5a5.5 5.5 0 100 11 5.5 5.5 0 000-11zM13 13l4 4',
  fast: 'M4 5l5 5-5 5M10.5 5l5 5-5 5',
  lease: 'M10 3.5a6.5 6.5 0 100 13 6.5 6.5 0 000-13zM10 8v8.5M3.7 8.5h12.6',
  undo: 'M8 4L4 8l4 4M4 8h7.5a4.5 4.5 0 010 9H8',
  redo: 'M12 4l4 4-4 4M16 8H8.5a4.5 4.5 0 000 9H12',
  delete: 'M4 5.5h12M8 5.5V3.5h4v2M5.5 5.5l.8 11h7.4l.8-11M8.5 8.5v5M11.5 8.5v5',
  freeze: 'M7 4v12M13 4v12',
  swap: 'M4 7h11M12 4l3 3-3 3M16 13H5M8 10l-3 3 3 3',
  follow: 'M10 6.5a3.5 3.5 0 100 7 3.5 3.5 0 000-7zM10 2v3M10 15v3M2 10h3M15 10h3',
  frame: 'M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4M8 8h4v4H8z',
  reset: 'M15.5 6.5A6.5 6.5 0 1016.5 10M16 3v4h-4',
  mine: 'M10 3.5a3 3 0 100 6 3 3 0 000-6zM4 17c0-3.5 2.5-5.5 6-5.5s6 2 6 5.5',
  hide: 'M2 10s3-5 8-5 8 5 8 5-3 5-8 5-8-5-8-5zM4 16.5L16 3.5',
  snapshot: 'M3 6.5h3.5L8 4.5h4l1.5 2H17v9H3zM10 8.2a2.8 2.8 0 100 5.6 2.8 2.8 0 000-5.6z',
  help: 'M7.5 7.5a2.5 2.5 0 115 0c0 1.8-2.5 2-2.5 4M10 14.5v.5',
};
