import type { Vec3 } from '../geometry/vec3';
import { DEFAULT_SIZE_M } from '../session/edits';
import type { Session } from '../session/session';
import { newUuid } from '../session/uuid';

/** Points that were clicked for something larger, numbered in both panes until that is made. */
export class ThingPoints {
  private readonly ids: string[] = [];
  readonly inWorld: Vec3[] = [];

  constructor(
    private readonly session: Session,
    private readonly colour: () => number,
  ) {}

  add(pointInWorld: Vec3): void {
    const requestId = newUuid();
    this.ids.push(requestId);
    this.inWorld.push(pointInWorld);
    this.session.annotations.addPending({
      ...{ requestId, shape: 'pin', text: String(this.ids.length), sizeM: DEFAULT_SIZE_M },
      ...{ colorRgba: this.colour(), pointInWorld },
    });
  }

  clear(): void {
    for (const id of this.ids) this.session.annotations.removePending(id);
    this.ids.length = this.inWorld.length = 0;
  }
}
