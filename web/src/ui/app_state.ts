import type { Pixel } from '../geometry/vec3';
import type { Landing } from '../tools/landing';
import type { CommandName, ToolName } from '../tools/tools';

export type PaneName = 'map' | 'video';

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
  editingId: string | undefined; // a note whose text is being typed
  hover: Hover | undefined;
  main: PaneName = 'map';
  confirmingReset = false;
  /** Why something could not be done, beside the thing that could not. */
  private readonly refusals = new Map<string, { text: string; untilMs: number }>();
  /** Rises with every change that panels show. */
  version = 0;

  changed(): void {
    ++this.version;
  }

  refuse(where: CommandName | PaneName | `annotation ${string}`, text: string): void {
    this.refusals.set(where, { text, untilMs: performance.now() + 6000 });
    this.changed();
  }

  refusal(where: CommandName | PaneName | `annotation ${string}`): string | undefined {
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
