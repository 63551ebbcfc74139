import type { Pixel, Vec3 } from '../geometry/vec3';
import type { Annotation } from '../session/types';
import type { Landing } from '../tools/landing';
import { type MarkFilter, type Me, NO_FILTER, passes } from '../tools/mark_filter';
import type { CommandName, MarkCommandName, ToolName } from '../tools/tools';

/** Where a refusal is shown: beside what could not be done. */
export type Place =
  | ToolName
  | CommandName
  | MarkCommandName
  | PaneName
  | 'head'
  | `annotation ${string}`;

export type PaneName = 'map' | 'video';

/** Panels that small windows show one at a time. */
export type SheetName = 'marks' | 'gaze' | 'talk';

export interface Hover {
  readonly pane: PaneName;
  readonly pixel: Pixel;
  readonly landing: Landing | undefined;
  /** Beside the ring; absent: how sure the landing is. */
  readonly words?: string | undefined;
}

/** What this person is doing; one owner, the app. */
export class AppState {
  tool: ToolName = 'select';
  private selected: ReadonlySet<string> = new Set();
  pointedId: string | undefined; // the one whose row is pointed at
  hover: Hover | undefined;
  /** Where the mouse is, in pixels of the page. */
  pointer: { readonly pane: PaneName; readonly x: number; readonly y: number } | undefined;
  /** The selected thing of the scene; empty: none. */
  thingId = '';
  main: PaneName = 'map';
  sheet: SheetName | undefined;
  confirmingReset = false;
  /** Which marks are listed and drawn. */
  filter: MarkFilter = NO_FILTER;
  hideMarks = false;
  /** As others see this person. */
  me: Me = { name: '', personId: '' };
  /** Of new marks, 0xRRGGBBAA: the person's own until another one is chosen. */
  colorRgba = 0xffffffff;
  colourChosen = false;
  /** Where this person points with the laser. */
  laser: { readonly pointInWorld: Vec3; readonly colorRgba: number } | undefined;
  /** A rectangle being drawn round marks, in that pane's pixels. */
  area: { readonly pane: PaneName; readonly from: Pixel; readonly to: Pixel } | undefined;
  /** Where the keyboard clicks in the video, as shares of the picture; undefined: not used yet. */
  cursor: { readonly x: number; readonly y: number } | undefined;
  byKeys = false; // it, and not the mouse, was moved last
  /** Marks that this person does not want to see drawn. */
  readonly hidden = new Set<string>();
  /** The head turns as fast as it can. */
  fast = false;
  /** What the camera was asked to look at, until the server says that it does. */
  askedInWorld: Vec3 | undefined;
  /** Why something could not be done, beside the thing that could not. */
  private readonly refusals = new Map<string, { text: string; untilMs: number }>();
  /** Rises with every change that panels show. */
  version = 0;
  /** Rises with every change, those that only the panes show included: they come with each move. */
  drawn = 0;

  /** The selected ones, in the order they were selected. */
  get selection(): ReadonlySet<string> {
    return this.selected;
  }

  select(ids: Iterable<string>): void {
    this.selected = new Set(ids);
    this.changed();
  }

  /** Adds it, or takes it away. */
  toggle(id: string): void {
    const { selected } = this;
    this.select(selected.has(id) ? [...selected].filter((each) => each !== id) : [...selected, id]);
  }

  /** The last one selected. */
  get selectedId(): string | undefined {
    return [...this.selected].at(-1);
  }

  set selectedId(id: string | undefined) {
    this.selected = new Set(id === undefined ? [] : [id]);
  }

  /** True if the list has it. */
  lists(annotation: Annotation): boolean {
    return passes(annotation, this.filter, this.me);
  }

  /** True if it is drawn: a selected one always is. */
  draws(annotation: Annotation): boolean {
    if (this.selected.has(annotation.id)) return true;
    return !this.hideMarks && !this.hidden.has(annotation.id) && this.lists(annotation);
  }

  /** The selected ones are not drawn any more; with none selected all are again, or none is. */
  hide(): void {
    for (const id of this.selected) this.hidden.add(id);
    if (this.selected.size > 0) this.select([]);
    else if (this.hidden.size > 0) this.hidden.clear();
    else this.hideMarks = !this.hideMarks;
    this.changed();
  }

  changed(): void {
    ++this.version;
    ++this.drawn;
  }

  /** Something that the panes alone show. */
  moved(): void {
    ++this.drawn;
  }

  refuse(where: Place, text: string): void {
    this.refusals.set(where, { text, untilMs: performance.now() + 6000 });
    this.changed();
  }

  /** Says what comes next, where it comes. */
  say(where: PaneName, text: string): void {
    this.refuse(where, text);
  }

  refusal(where: Place): string | undefined {
    return this.refusals.get(where)?.text;
  }

  /** Forgets refusals that have been read. */
  expire(nowMs: number): void {
    for (const [where, { untilMs }] of this.refusals) {
      if (nowMs < untilMs) continue;
      this.refusals.delete(where);
      this.changed();
    }
  }
}
