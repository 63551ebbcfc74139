import type { Pixel } from '../geometry/vec3';
import type { View } from '../geometry/view';
import { EditError, type Edits } from '../session/edits';
import type { Session } from '../session/session';
import { type Annotation, isPlaced } from '../session/types';
import { type Landing, landingInMap, landingInVideo, rayThrough } from '../tools/landing';
import { pickNearest } from '../tools/pick';
import { type CommandName, type MarkCommandName, shapeOf, type ToolName } from '../tools/tools';
import type { AnnotationActions } from './annotations_panel';
import type { AppState, PaneName, Place } from './app_state';
import type { GazeController } from './gaze_controller';
import type { MapPane } from './map_pane';
import type { Notes } from './notes';
import type { MapGestures } from './pointer';
import type { ToolActions } from './tools_column';
import type { VideoPane } from './video_pane';

const PICK_PX = 22; // CSS px: a fingertip's half

/** What a click or key does, given the tool in hand. */
export class Controller implements ToolActions, AnnotationActions {
  /** What was under the pointer when it went down: the picture may change before it comes up. */
  private pressed: { landing: Landing | undefined; picked: Annotation | undefined } | undefined;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
    private readonly map: MapPane,
    private readonly video: VideoPane,
    private readonly gaze: GazeController,
    private readonly notes: Notes,
  ) {}

  choose(tool: ToolName): void {
    const whyNot = tool === 'gaze' ? this.gaze.whyNot() : undefined;
    if (whyNot) return this.state.refuse('gaze', whyNot);
    this.state.tool = tool;
    this.state.hover = undefined;
    this.state.changed();
  }

  run(command: CommandName): void {
    const { state, map } = this;
    switch (command) {
      case 'undo':
        this.attempt('undo', () => this.edits.undo());
        break;
      case 'redo':
        this.attempt('redo', () => this.edits.redo());
        break;
      case 'delete':
        if (state.selectedId) this.remove(state.selectedId);
        else state.refuse('delete', 'Select a mark first.');
        break;
      case 'freeze':
        if (this.video.frozen) this.video.thaw();
        else if (!this.video.freeze()) state.refuse('freeze', this.video.whyNoPicture);
        state.hover = undefined;
        break;
      case 'swap':
        state.main = state.main === 'map' ? 'video' : 'map';
        break;
      case 'follow':
        if (map.map) map.map.following = !map.map.following;
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
    else if (command === 'hide') state.hideMarks = !state.hideMarks;
    else {
      this.video
        .snapshot(state.myName)
        .catch((error: unknown) => state.refuse('snapshot', `No snapshot: ${String(error)}`));
    }
    state.changed();
  }

  confirmReset(really: boolean): void {
    this.state.confirmingReset = false;
    this.state.changed();
    if (really) this.attempt('reset', () => this.edits.resetMap());
  }

  /** Escape: leave whatever is under way, one thing at a time. */
  escape(): void {
    const { state } = this;
    if (state.confirmingReset) state.confirmingReset = false;
    else if (state.tool !== 'select') this.choose('select');
    else if (this.video.frozen) this.video.thaw();
    else state.selectedId = undefined;
    state.changed();
  }

  select(id: string): void {
    this.state.selectedId = this.state.selectedId === id ? undefined : id;
    this.state.changed();
  }

  point(id: string | undefined): void {
    this.state.pointedId = id;
    this.state.changed();
  }

  remove(id: string): void {
    if (this.state.selectedId === id) this.state.selectedId = undefined;
    this.attempt(`annotation ${id}`, () => this.edits.remove(id));
  }

  startEditing(id: string): void {
    this.notes.edit(id);
  }

  mapGestures(): MapGestures {
    return {
      hover: (x, y) => this.hover('map', this.map.pixelAt(x, y)),
      leave: () => this.leave('map'),
      moved: () => {
        this.state.hover = undefined;
        this.map.map?.hold();
      },
      click: (x, y) => {
        const view = this.map.view();
        const pixel = this.map.pixelAt(x, y);
        this.act('map', this.landing('map', pixel), view && this.pick(view, pixel, PICK_PX));
      },
    };
  }

  videoGestures(): Omit<MapGestures, 'moved'> & { press(x: number, y: number): void } {
    return {
      hover: (x, y) => this.hover('video', this.video.pixelAt(x, y)),
      leave: () => this.leave('video'),
      press: (x, y) => {
        const pixel = this.video.pixelAt(x, y);
        const current = this.video.current();
        const view = current?.view;
        if (current && pixel) {
          const { dataset } = this.video.element; // for tests: which frame a click meant
          dataset['pressed'] = `${current.facts.frameId} ${pixel.u} ${pixel.v}`;
        }
        this.pressed = pixel && {
          landing: this.landing('video', pixel),
          picked: view && this.pick(view, pixel, PICK_PX / this.video.scale),
        };
      },
      click: () => {
        const { pressed } = this;
        this.pressed = undefined;
        this.act('video', pressed?.landing, pressed?.picked);
      },
    };
  }

  /** Keyboard: acts at the middle of the pane. */
  clickMiddle(pane: PaneName): void {
    const { element } = pane === 'map' ? this.map : this.video;
    const box = element.getBoundingClientRect();
    const x = box.left + box.width / 2;
    const y = box.top + box.height / 2;
    if (pane === 'map') this.mapGestures().click(x, y);
    else {
      const gestures = this.videoGestures();
      gestures.press(x, y);
      gestures.click(x, y);
    }
  }

  private hover(pane: PaneName, pixel: Pixel | undefined): void {
    const { state } = this;
    if (state.tool === 'select') {
      state.hover = undefined;
      return this.pointAt(pane, pixel);
    }
    state.hover = pixel && { pane, pixel, landing: this.landing(pane, pixel) };
    state.changed();
  }

  /** The mark under the pointer shows all that it says. */
  private pointAt(pane: PaneName, pixel: Pixel | undefined): void {
    const view = pane === 'map' ? this.map.view() : this.video.current()?.view;
    const radius = pane === 'map' ? PICK_PX : PICK_PX / this.video.scale;
    const id = view && pixel && this.pick(view, pixel, radius)?.id;
    if (id !== this.state.pointedId) this.point(id);
  }

  private leave(pane: PaneName): void {
    if (this.state.tool === 'select' && this.state.pointedId) this.point(undefined);
    if (this.state.hover?.pane !== pane) return;
    this.state.hover = undefined;
    this.state.changed();
  }

  private landing(pane: PaneName, pixel: Pixel): Landing | undefined {
    const features = this.session.map.features.values();
    if (pane === 'map') {
      const view = this.map.view();
      return view && landingInMap(view, pixel, features);
    }
    const current = this.video.current();
    if (!current?.view) return undefined;
    const landing = landingInVideo(current.view, current.facts.frameId, pixel, features);
    // A frozen picture is clicked late, a note is placed when its text is done.
    const late = this.video.frozen || this.state.tool === 'note';
    if (!landing || !late || !this.video.sameMap) return landing;
    return { ...landing, later: rayThrough(current.view, pixel) };
  }

  private pick(view: View, pixel: Pixel, radius: number): Annotation | undefined {
    const annotations = this.session.annotations.list().filter((each) => this.state.draws(each));
    return pickNearest(view, pixel, annotations, ({ anchor }) => anchor.pointInWorld, radius);
  }

  private act(pane: PaneName, landing: Landing | undefined, picked: Annotation | undefined): void {
    const { state } = this;
    if (this.notes.takeClick()) return;
    if (state.tool === 'gaze') return this.look(pane, landing, picked);
    const shape = shapeOf(state.tool);
    if (!shape) {
      state.selectedId = picked?.id;
      return state.changed();
    }
    if (shape === 'note') return this.notes.click(landing, this.whyNoLanding(pane));
    if (!this.session.live) return state.refuse(pane, 'Not placed: no connection to the server.');
    if (!landing) return state.refuse(pane, `Not placed: ${this.whyNoLanding(pane)}`);
    this.attempt(pane, async () => {
      const placed = await this.edits.place({
        shape,
        text: '',
        colorRgba: state.colorRgba,
        target: landing.target,
        later: landing.later,
        guessInWorld: landing.pointInWorld,
      });
      state.selectedId = placed.id;
      state.changed();
    });
  }

  private whyNoLanding(pane: PaneName): string {
    if (pane === 'map') {
      return this.map.view() ? 'nothing is mapped there.' : 'the map is not shown yet.';
    }
    const current = this.video.current();
    if (!current) return 'there is no picture yet.';
    const placed = isPlaced(current.facts.pose);
    return placed ? 'that is outside the picture.' : 'where the camera is is not known now.';
  }

  /** Turns the camera there; a mark there is followed, if it is moved. */
  private look(pane: PaneName, landing: Landing | undefined, picked: Annotation | undefined): void {
    if (picked) return this.gaze.lookAtMark(picked, pane);
    if (!landing) return this.state.refuse(pane, `Not turned: ${this.whyNoLanding(pane)}`);
    if (pane === 'video' && this.video.frozen && !landing.later) {
      return this.state.refuse(pane, 'Not turned: the map has changed since this picture.');
    }
    this.gaze.lookAtLanding(landing, pane);
  }

  lookAt(id: string): void {
    const annotation = this.session.annotations.get(id);
    if (annotation) this.gaze.lookAtMark(annotation, `annotation ${id}`);
  }

  /** Of new marks, and of the selected one. */
  paint(colorRgba: number): void {
    const { state } = this;
    state.colorRgba = colorRgba;
    state.changed();
    const id = state.selectedId;
    if (id) this.attempt(`annotation ${id}`, () => this.edits.setColour(id, colorRgba));
  }

  /** Runs an edit; a refusal is shown where it was asked for. */
  private attempt(where: Place, edit: () => Promise<unknown>): void {
    edit()
      .catch((error: unknown) => {
        const reason = error instanceof EditError ? error.message : String(error);
        this.state.refuse(
          where,
          where === 'map' || where === 'video' ? `Not placed: ${reason}` : reason,
        );
      })
      .finally(() => this.state.changed());
  }
}
