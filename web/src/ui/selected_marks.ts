import type { Quaternion } from '../geometry/rigid3';
import { add, subtract, type Vec3 } from '../geometry/vec3';
import type { Edits, Placement } from '../session/edits';
import { isOwn, roleOf } from '../session/me';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import { newUuid } from '../session/uuid';
import type { Landing } from '../tools/landing';
import { turnedBy } from '../tools/turn';
import type { Aim } from './aim';
import type { AppState, PaneName, Place } from './app_state';
import { attempt } from './attempt';
import { whyNotChange, whyNotEdit } from './rights';

const STEP_RAD = Math.PI / 12;
const SETTLES_MS = 500; // several presses of a key are one turn

interface Copied {
  readonly mark: Annotation;
  readonly offset: Vec3; // from the first one
}

/** What happens to the selected marks together; each thing is one step of undo. */
export class SelectedMarks {
  private copied: readonly Copied[] = [];
  private readonly turns = new Map<string, Quaternion>();
  private settle: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly aim: Aim,
  ) {}

  private get marks(): Annotation[] {
    return [...this.state.selection].flatMap((id) => this.session.annotations.get(id) ?? []);
  }

  /** The selected ones, if there are some and all are this person's to change; else says why not. */
  private changeable(where: Place): Annotation[] {
    const { marks, session, state } = this;
    const why =
      marks.length === 0
        ? 'Select a mark first.'
        : marks.map((mark) => whyNotChange(session, mark)).find(Boolean);
    if (!why) return marks;
    state.refuse(where, why);
    return [];
  }

  remove(): void {
    const marks = this.changeable('delete');
    if (marks.length === 0) return;
    this.state.selectedId = undefined;
    const group = groupOf(marks);
    for (const { id } of marks) {
      void attempt(this.state, 'delete', () => this.edits.remove(id, group));
    }
  }

  /** Locks them, or unlocks them where all are locked. */
  lock(): void {
    const { session, state } = this;
    const marks = this.changeable('lock');
    const mine = (mark: Annotation): boolean =>
      roleOf(session) === 'wearer' || isOwn(session, mark);
    const other = marks.find((mark) => !mine(mark));
    if (other) {
      const { author } = other;
      return state.refuse('lock', `Only ${author}, whose mark it is, and the wearer lock it.`);
    }
    const locked = !marks.every((mark) => mark.locked);
    const group = groupOf(marks);
    for (const { id } of marks) {
      void attempt(state, 'lock', () => this.edits.change(id, { locked }, group));
    }
  }

  paint(colorRgba: number): void {
    const { marks, state, session } = this;
    const group = groupOf(marks);
    for (const mark of marks) {
      const why = whyNotChange(session, mark);
      if (why) state.refuse(`annotation ${mark.id}`, why);
      else {
        const edit = (): Promise<void> => this.edits.change(mark.id, { colorRgba }, group);
        void attempt(state, `annotation ${mark.id}`, edit);
      }
    }
  }

  copy(): void {
    const placed = this.marks.filter(({ anchor }) => anchor.pointInWorld);
    const from = placed[0]?.anchor.pointInWorld;
    if (!from) return this.state.refuse('copy', 'Select a mark first.');
    this.copied = placed.map((mark) => ({
      mark,
      offset: subtract(mark.anchor.pointInWorld ?? from, from),
    }));
    const count = placed.length === 1 ? 'The mark is' : `${placed.length} marks are`;
    this.state.refuse('copy', `${count} copied: ^V puts it where the pointer is.`);
  }

  /** Where the pointer is, else in the middle of the large pane. */
  paste(): void {
    const { state, aim, copied, session } = this;
    const [first, ...others] = copied;
    const why = whyNotEdit(session) ?? (first ? undefined : 'Copy a mark first (^C).');
    if (why !== undefined || !first) return state.refuse('paste', why ?? '');
    const pane = state.pointer?.pane ?? state.main;
    const place = state.pointer ?? aim.keyPlace(pane);
    const pixel = aim.pixelAt(pane, place.x, place.y);
    const landing = pixel && aim.landing(pane, pixel, true);
    if (!landing) return state.refuse('paste', `Not placed: ${aim.whyNoLanding(pane)}`);
    void attempt(state, 'paste', () => this.put(first, others, landing), 'Not pasted: ');
  }

  private async put(
    first: Copied,
    others: readonly Copied[],
    { target, later, pointInWorld }: Landing,
  ): Promise<void> {
    const editGroup = others.length > 0 ? newUuid() : undefined;
    const form = await this.formOf(first.mark);
    const site = { target, later, guessInWorld: pointInWorld };
    const placed = await this.edits.place({ ...form, ...site, editGroup });
    const at = placed.anchor.pointInWorld ?? pointInWorld;
    const ids = [placed.id];
    for (const { mark, offset } of others) {
      const to = add(at, offset);
      const where = { target: { kind: 'point', pointInWorld: to }, guessInWorld: to } as const;
      const next = await this.edits.place({ ...(await this.formOf(mark)), ...where, editGroup });
      ids.push(next.id);
    }
    this.state.select(ids);
  }

  private async formOf(mark: Annotation): Promise<Omit<Placement, 'target' | 'guessInWorld'>> {
    const { shape, text, colorRgba, sizeM, worldFromMark, extentM, inkOffsetsM, picture } = mark;
    const form = { shape, text, colorRgba, sizeM, worldFromMark, extentM, inkOffsetsM };
    if (shape === 'check_list') return { ...form, checkItems: mark.checkItems.map((i) => i.text) };
    if (shape !== 'picture' || !picture) return form;
    const bytes = await this.edits.picture(mark.id);
    return { ...form, picture: { bytes, width: picture.width, height: picture.height } };
  }

  /** Turns the selected arrows and boxes by a step; false if there is none. */
  turn(sign: 1 | -1, tips: boolean): boolean {
    const { state, session, aim } = this;
    const turnable = this.marks.filter(({ shape }) => shape === 'arrow' || shape === 'box');
    const pane: PaneName = state.main;
    const view = aim.view(pane);
    if (turnable.length === 0 || !view) return false;
    for (const mark of turnable) {
      const why = whyNotChange(session, mark);
      if (why) {
        state.refuse(pane, `Not turned: ${why}`);
        continue;
      }
      const before = this.turns.get(mark.id) ?? mark.worldFromMark;
      const worldFromMark = turnedBy(view, before, sign * STEP_RAD, tips);
      this.turns.set(mark.id, worldFromMark);
      session.annotations.preview(mark.id, (each) => ({ ...each, worldFromMark }));
    }
    clearTimeout(this.settle);
    this.settle = setTimeout(() => this.sendTurns(pane), SETTLES_MS);
    return true;
  }

  private sendTurns(pane: PaneName): void {
    const turns = [...this.turns];
    this.turns.clear();
    const group = turns.length > 1 ? newUuid() : '';
    for (const [id, worldFromMark] of turns) {
      const edit = (): Promise<void> => this.edits.change(id, { worldFromMark }, group);
      void attempt(this.state, pane, edit, 'Not turned: ').then(() =>
        this.session.annotations.endPreview(id),
      );
    }
  }
}

const groupOf = (marks: readonly Annotation[]): string => (marks.length > 1 ? newUuid() : '');
