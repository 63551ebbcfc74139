import type { Edits } from '../session/edits';
import type { Session } from '../session/session';
import type { Annotation } from '../session/types';
import type { Landing } from '../tools/landing';
import { type CommandName, type MarkCommandName, shapeOf, type ToolName } from '../tools/tools';
import type { AnnotationActions } from './annotations_panel';
import type { AppState, PaneName } from './app_state';
import { attempt } from './attempt';
import type { GazeController } from './gaze_controller';
import { Hand, type HandHelpers } from './hand';
import type { Notes } from './notes';
import type { Placer } from './placer';
import { whyNotChange, whyNotEdit } from './rights';
import type { SelectedMarks } from './selected_marks';
import { type Spot, spotAt } from './thing_spot';
import type { ToolActions } from './tools_column';

/** What clicks and keys are handed to. */
export interface Helpers extends HandHelpers {
  readonly gaze: GazeController;
  readonly notes: Notes;
  readonly placer: Placer;
  readonly selected: SelectedMarks;
}

const NO_EDIT: readonly ToolName[] = ['select', 'area', 'gaze', 'thing'];

/** What a click or key does, given the tool in hand. */
export class Controller implements ToolActions, AnnotationActions {
  readonly hand: Hand;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly with_: Helpers,
  ) {
    this.hand = new Hand(state, with_, this);
  }

  choose(tool: ToolName): void {
    const { state } = this;
    const edits = !NO_EDIT.includes(tool);
    const whyNot =
      tool === 'gaze' ? this.with_.gaze.whyNot() : edits ? whyNotEdit(this.session) : undefined;
    if (whyNot) return state.refuse(tool, whyNot);
    this.hand.letGo();
    if (tool === 'thing' && state.tool === tool) this.with_.things.focus();
    state.tool = tool;
    state.hover = undefined;
    state.changed();
  }

  run(command: CommandName): void {
    const { state } = this;
    const { map, video } = this.with_.aim;
    switch (command) {
      case 'undo':
        if (state.tool === 'thing') {
          this.with_.things.undo();
          break;
        }
        void attempt(state, command, () => this.edits[command]());
        break;
      case 'redo':
        void attempt(state, command, async () => {
          const words = await this.edits[command]();
          if (words.includes('stays: ')) state.refuse(command, words);
        });
        break;
      case 'delete':
        if (state.tool === 'thing') this.with_.things.moves.remove();
        else this.with_.selected.remove();
        break;
      case 'copy':
      case 'paste':
      case 'lock':
        this.with_.selected[command]();
        break;
      case 'freeze':
        if (video.frozen) video.thaw();
        else if (!video.freeze()) state.refuse('freeze', video.whyNoPicture);
        state.hover = undefined;
        break;
      case 'swap':
        state.main = state.main === 'map' ? 'video' : 'map';
        break;
      case 'follow':
        map.map?.follow(!map.map.following);
        break;
      case 'frame':
        map.map?.frameAll();
        break;
      case 'reset':
        state.confirmingReset = !state.confirmingReset;
        break;
    }
    state.changed();
  }

  runMarks(command: MarkCommandName): void {
    const { state } = this;
    if (command === 'mine') state.filter = { ...state.filter, mine: !state.filter.mine };
    else if (command === 'hide') state.hide();
    else {
      this.with_.aim.video
        .snapshot(state.me.name)
        .catch((error: unknown) => state.refuse('snapshot', `No snapshot: ${String(error)}`));
    }
    state.changed();
  }

  confirmReset(really: boolean): void {
    this.state.confirmingReset = false;
    this.state.changed();
    if (really) void attempt(this.state, 'reset', () => this.edits.resetMap());
  }

  /** Escape: leave whatever is under way, one thing at a time. */
  escape(): void {
    const { state } = this;
    const { video } = this.with_.aim;
    if (state.confirmingReset) state.confirmingReset = false;
    else if (this.hand.busy) this.hand.letGo();
    else if (state.tool !== 'select') this.choose('select');
    else if (video.frozen) video.thaw();
    else if (state.main === 'map' && this.with_.aim.map.walks) this.with_.aim.map.stand('orbit');
    else state.selectedId = undefined;
    state.changed();
  }

  /** `adds`: to those selected, or from them. */
  select(id: string, adds = false): void {
    const { state } = this;
    if (adds || state.tool === 'area') return state.toggle(id);
    const alone = state.selection.size === 1 && state.selection.has(id);
    state.select(alone ? [] : [id]);
    if (!alone) this.with_.aim.map.map?.reveal(this.session.annotations.get(id));
  }

  selectAll(): void {
    this.state.select(this.with_.aim.map.marks().flatMap(({ id }) => (id ? [id] : [])));
  }

  point(id: string | undefined): void {
    this.state.pointedId = id;
    this.state.changed();
  }

  remove(id: string): void {
    const mark = this.session.annotations.get(id);
    const why = mark && whyNotChange(this.session, mark);
    if (why) return this.state.refuse(`annotation ${id}`, why);
    this.state.select([...this.state.selection].filter((each) => each !== id));
    void attempt(this.state, `annotation ${id}`, () => this.edits.remove(id));
  }

  /** The words of the selected mark. */
  editSelected(): void {
    const { selectedId } = this.state;
    if (selectedId) this.startEditing(selectedId);
  }

  startEditing(id: string): void {
    const mark = this.session.annotations.get(id);
    const why = mark && whyNotChange(this.session, mark);
    if (why) this.state.refuse(`annotation ${id}`, why);
    else this.with_.notes.edit(id);
  }

  tick(id: string, index: number, done: boolean): void {
    const why = whyNotEdit(this.session);
    if (why) return this.state.refuse(`annotation ${id}`, why);
    void attempt(this.state, `annotation ${id}`, () => this.edits.tick(id, index, done));
  }

  turn(sign: 1 | -1, tips: boolean): boolean {
    return this.with_.selected.turn(sign, tips);
  }

  /** What a click does. */
  act(
    pane: PaneName,
    landing: Landing | undefined,
    picked: Annotation | undefined,
    adds: boolean,
    spot: Spot | undefined,
  ): void {
    const { state } = this;
    const { notes, placer } = this.with_;
    if (notes.takeClick()) return;
    if (state.tool === 'thing') return this.with_.things.click(pane, spot);
    if (state.tool === 'gaze') return this.look(pane, landing, picked);
    const shape = shapeOf(state.tool);
    if (shape) return placer.click(shape, pane, landing);
    if (state.tool === 'laser') return;
    if (picked && (adds || state.tool === 'area')) return state.toggle(picked.id);
    if (!adds) state.selectedId = picked?.id;
    state.changed();
  }

  /** Turns the camera there; a mark there is followed, if it is moved. */
  private look(pane: PaneName, landing: Landing | undefined, picked: Annotation | undefined): void {
    const { gaze, aim } = this.with_;
    if (picked) return gaze.lookAtMark(picked, pane);
    if (!landing) return this.state.refuse(pane, `Not turned: ${aim.whyNoLanding(pane)}`);
    if (pane === 'video' && aim.video.frozen && !landing.later) {
      return this.state.refuse(pane, 'Not turned: the map has changed since this picture.');
    }
    gaze.lookAtLanding(landing, pane);
  }

  lookAt(id: string): void {
    const annotation = this.session.annotations.get(id);
    if (annotation) this.with_.gaze.lookAtMark(annotation, `annotation ${id}`);
  }

  /** Of new marks, and of the selected ones. */
  paint(colorRgba: number): void {
    const { state } = this;
    state.colorRgba = colorRgba;
    state.colourChosen = true;
    state.changed();
    this.with_.selected.paint(colorRgba);
  }

  /** A file that was dropped on a pane. */
  drop(pane: PaneName, x: number, y: number, file: File): void {
    const { aim, placer } = this.with_;
    const pixel = aim.pixelAt(pane, x, y);
    const landing = pixel && aim.landing(pane, pixel, true);
    const why = whyNotEdit(this.session);
    if (why !== undefined) return this.state.refuse(pane, why);
    if (/\.glb$/i.test(file.name)) {
      this.choose('thing');
      return this.with_.things.take(pane, pixel && spotAt(aim, pane, pixel), file);
    }
    if (landing) return void placer.picture(pane, landing, file);
    this.state.refuse(pane, `Not placed: ${aim.whyNoLanding(pane)}`);
  }
}
