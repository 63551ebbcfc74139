import { add, distance, dot, scale, subtract, type Vec3 } from '../geometry/vec3';
import { eyeOf, rayOf } from '../geometry/view';
import { DEFAULT_SIZE_M } from '../session/edits';
import type { Thing } from '../session/scene_book';
import type { Session } from '../session/session';
import { newUuid } from '../session/uuid';
import { DOWN, wayBetween } from '../tools/thing_places';
import type { Aim } from './aim';
import type { AppState, PaneName } from './app_state';
import type { Drag } from './drag';

const MOST_HAND_M = 20; // PlaceSceneObjectRequest

/** Pulls a thing the way it is to be pushed along the floor; a line says which. */
export class ThingDrag implements Drag {
  readonly clicks = true;
  private readonly pendingId = newUuid();
  private first: Vec3 | undefined; // where it was taken hold of, as high as its base
  private way: Vec3 | undefined;
  private handM = 0;

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    private readonly aim: Aim,
    private readonly pane: PaneName,
    private readonly thing: Thing,
    private readonly push: (way: Vec3, handM: number) => void,
  ) {}

  move(x: number, y: number): void {
    const from = this.thing.parentFromObject.translation;
    const under = this.onFloor(x, y, from);
    this.first ??= under;
    this.way = under && this.first && wayBetween(this.first, under);
    this.handM = under && this.first ? Math.min(distance(this.first, under), MOST_HAND_M) : 0;
    if (!under || !this.first) return;
    const to = add(from, subtract(under, this.first));
    this.session.annotations.addPending({
      ...{ requestId: this.pendingId, shape: 'measure', text: '', sizeM: DEFAULT_SIZE_M },
      ...{ colorRgba: this.state.colorRgba, pointInWorld: from },
      inkOffsetsM: [subtract(to, from)],
    });
  }

  /** Under the pointer, as high as the thing's base. */
  private onFloor(x: number, y: number, base: Vec3): Vec3 | undefined {
    const view = this.aim.view(this.pane);
    const direction = view && rayOf(view, this.aim.pixelNear(this.pane, x, y));
    if (!view || !direction) return undefined;
    const along = dot(direction, DOWN);
    const t = dot(subtract(base, eyeOf(view)), DOWN) / along;
    return Math.abs(along) > 1e-3 && t > 0 ? add(eyeOf(view), scale(direction, t)) : undefined;
  }

  end(x: number, y: number): void {
    this.move(x, y);
    const { way } = this;
    this.cancel();
    if (way) this.push(way, this.handM);
    else this.state.refuse(this.pane, 'Not pushed: drag it along the floor, the way it is to go.');
  }

  cancel(): void {
    this.session.annotations.removePending(this.pendingId);
  }
}
