import type { Pixel, Vec3 } from '../geometry/vec3';
import type { Annotation } from '../session/types';
import type { Landing } from '../tools/landing';
import { type MarkFilter, NO_FILTER, passes } from '../tools/mark_filter';
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
}

/** What this person is doing; one owner, the app. */
export class AppState {
  tool: ToolName = 'select';
  selectedId: string | undefined;
  pointedId: string | undefined; // the one whose row is pointed at
  hover: Hover | undefined;
  main: PaneName = 'map';
  sheet: SheetName | undefined;
  confirmingReset = false;
  /** Which marks are listed and drawn. */
  filter: MarkFilter = NO_FILTER;
  hideMarks = false;
  /** As others see this person. */
  myName = '';
  /** Of new marks, 0xRRGGBBAA. */
  colorRgba = 0xffffffff;
  /** The head turns as fast as it can. */
  fast = false;
  /** What the camera was asked to look at, until the server says that it does. */
  askedInWorld: Vec3 | undefined;
  /** Why something could not be done, beside the thing that could not. */
  private readonly refusals = new Map<string, { text: string; untilMs: number }>();
  /** Rises with every change that panels show. */
  version = 0;

  /** True if the list has it. */
  lists(annotation: Annotation): boolean {
    return passes(annotation, this.filter, this.myName);
  }

  /** True if it is drawn: a selected one always is. */
  draws(annotation: Annotation): boolean {
    if (annotation.id === this.selectedId) return true;
    return !this.hideMarks && this.lists(annotation);
  }

  changed(): void {
    ++this.version;
  }

  refuse(where: Place, text: string): void {
    this.refusals.set(where, { text, untilMs: performance.now() + 6000 });
    this.changed();
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
