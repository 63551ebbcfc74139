import { Edits } from '../session/edits';
import { gazeKey, hasHead } from '../session/gaze';
import { GazePilot } from '../session/gaze_pilot';
import { LatencyMeter, RateMeter, stageTimes } from '../session/latency';
import { personIdOf } from '../session/me';
import { isNameless, keepName } from '../session/name';
import type { Session } from '../session/session';
import type { Participant } from '../session/types';
import { shapeOf, TOOLS } from '../tools/tools';
import { WorkerKeeping } from '../transport/lease_keeper';
import { Aim } from './aim';
import { AnnotationsPanel } from './annotations_panel';
import { AppState } from './app_state';
import { Controller } from './controller';
import { h, setAttribute, setClass, storage } from './dom';
import { FirstTask } from './first_task';
import { GazeController } from './gaze_controller';
import { GazePanel } from './gaze_panel';
import { HandoverNotice } from './handover_notice';
import { Grips } from './grips';
import type { Hand } from './hand';
import { Header } from './header';
import { Help } from './help';
import { InsetCorner } from './inset';
import { handleKeys } from './keys';
import { ListDialog } from './list_dialog';
import { MapPane } from './map_pane';
import { MapsSheet } from './maps_sheet';
import { Measuring } from './measuring';
import { NameDialog } from './name_dialog';
import { Notes } from './notes';
import { PictureCache } from './picture_cache';
import { PictureDialog } from './picture_dialog';
import type { Player } from './player';
import { Placer } from './placer';
import { handleDrop, handleMapPointer, handleVideoPointer } from './pointer';
import { RecordControl } from './record_control';
import { whyNotEdit } from './rights';
import { SelectedMarks } from './selected_marks';
import { Sheets } from './sheets';
import { Strip } from './strip';
import { handleTalkKeys } from './talk_keys';
import { TalkPanel } from './talk_panel';
import { Things } from './things';
import { ThingsPanel } from './things_panel';
import { ToolNames } from './tool_names';
import { ToolsColumn } from './tools_column';
import { VideoPane } from './video_pane';
import { handleWalking } from './walking';

const MAP_AT_LATEST_MS = 1500;
const PANEL_MS = 200; // moving numbers change five times a second: readable

/** What only those may use who may change something. */
const CHANGES = new Set<string>([
  ...TOOLS.map(({ name }) => name).filter((name) => shapeOf(name) !== undefined),
  ...['laser', 'undo', 'redo', 'delete', 'paste', 'lock', 'reset'],
]);

const median = (values: readonly number[]): string =>
  ([...values].sort((a, b) => a - b)[values.length >> 1] ?? 0).toFixed(2);

/** The expert's page: builds it, and draws it once per screen frame. */
export class App {
  readonly element: HTMLElement;
  private readonly state = new AppState();
  private readonly meter = new LatencyMeter();
  private readonly screen = new RateMeter();
  private readonly help = new Help();
  private readonly header = new Header(this.help.button, (name) => this.session.rename(name));
  private readonly strip = new Strip();
  private readonly sheets = new Sheets(this.state);
  private readonly inset = new InsetCorner();
  private readonly map: MapPane;
  private readonly video: VideoPane;
  private readonly tools: ToolsColumn;
  private readonly annotations: AnnotationsPanel;
  private readonly pilot: GazePilot;
  private readonly gaze: GazePanel;
  private readonly notice: HandoverNotice;
  private readonly hand: Hand;
  private readonly talk: TalkPanel;
  private readonly thingsPanel: ThingsPanel;
  private readonly firstTask: FirstTask;
  private readonly record: RecordControl;
  private readonly stage = h('main', {});
  private nameless = isNameless(location.search, storage());
  private mapLoading = false;
  private panelsMs = 0;
  private panelsVersion = '';

  constructor(
    private readonly session: Session,
    private readonly player: Player,
    token: () => string,
  ) {
    const { state } = this;
    const edits = new Edits(session);
    const pictures = new PictureCache(
      (id) => edits.picture(id),
      () => state.moved(),
    );
    this.map = new MapPane(session, player, state, pictures);
    this.video = new VideoPane(session, player, state, pictures);
    this.pilot = new GazePilot(session, new WorkerKeeping(location.origin, token));
    const gaze = new GazeController(session, this.pilot, state);
    const notes = new Notes(session, edits, state);
    const aim = new Aim(session, state, this.map, this.video);
    const measuring = new Measuring(session, edits, state);
    const things = new Things(session, state, aim);
    this.thingsPanel = new ThingsPanel(session, state, things, aim);
    things.focus = () => this.thingsPanel.focus();
    const dialogs = { list: new ListDialog(), picture: new PictureDialog() };
    const controller = new Controller(session, edits, state, {
      ...{ aim, gaze, notes, measuring, things },
      placer: new Placer(session, edits, state, aim, notes, measuring, dialogs),
      grips: new Grips(session, edits, state, aim, things),
      selected: new SelectedMarks(session, edits, state, aim),
    });
    this.hand = controller.hand;
    this.tools = new ToolsColumn(controller);
    this.annotations = new AnnotationsPanel(session, state, controller, notes.editor.element);
    this.gaze = new GazePanel(session, this.pilot, state, gaze);
    this.notice = new HandoverNotice(session);
    const lookHere = (id: string): void => {
      state.selectedId = id;
      this.map.lookAt(id);
      state.changed();
    };
    this.talk = new TalkPanel(session, state, lookHere, () => this.showSheet());
    this.firstTask = new FirstTask(session, this.map, this.video);
    this.help.onFirstTask = () => this.firstTask.begin();
    const maps = new MapsSheet(session);
    this.help.onMaps = () => maps.open();
    this.record = new RecordControl(session);
    this.strip.element.append(maps.button, this.record.button);
    new ToolNames(this.tools.element);
    this.stage.append(this.map.element, this.video.element, this.notice.element);
    this.stage.append(this.firstTask.element, this.thingsPanel.element);
    this.element = h('div', { class: 'app' });
    this.element.append(
      this.header.element,
      this.tools.element,
      this.stage,
      h('div', { class: 'side' }, this.annotations.element, this.gaze.element, this.talk.element),
      this.strip.element,
      this.sheets.element,
      this.help.dialog,
      maps.dialog,
      dialogs.list.dialog,
      dialogs.picture.dialog,
    );
    notes.listen();
    session.pointers.heard = () => {
      this.video.drawPointers();
      this.map.drawPointers();
    };
    handleMapPointer(this.map, controller.hand.gestures('map'));
    handleVideoPointer(this.video.element, controller.hand.gestures('video'));
    for (const pane of ['map', 'video'] as const) {
      handleDrop(this[pane].element, (x, y, file) => controller.drop(pane, x, y, file));
    }
    handleWalking(this.map);
    handleKeys(controller, gaze, this.map, this.video, this.help, () => {
      state.sheet = 'marks';
      this.showSheet();
      this.annotations.bar.focus();
    });
    handleTalkKeys(this.talk, this.help.dialog);
  }

  /** At once: a field must be there to be given the keyboard. */
  private showSheet(): void {
    this.element.dataset['sheet'] = this.state.sheet ?? '';
  }

  start(): void {
    window.addEventListener('pagehide', () => this.pilot.leave());
    // The first picture comes first; three.js, the larger part of the page, after it.
    setTimeout(() => this.loadMap(), MAP_AT_LATEST_MS);
    requestAnimationFrame((nowMs) => this.frame(nowMs));
  }

  /**
   * Once: whoever has said it, or came with it, is not asked again; nor is who signed in, for the server knows
   * who that is. Who is refused has a way in to choose first.
   */
  private askName(me: Participant | undefined): void {
    const { session } = this;
    if (!this.nameless || (!me && session.link.kind !== 'waiting')) return;
    this.nameless = false;
    if (me && me.name !== session.displayName) return;
    const dialog = new NameDialog(this.session.displayName, (name) => {
      keepName(name, storage());
      this.header.setName(name);
      this.session.rename(name);
    });
    this.element.append(dialog.dialog);
    dialog.ask();
  }

  private loadMap(): void {
    if (this.mapLoading) return;
    this.mapLoading = true;
    void this.map.load();
  }

  private frame(nowMs: number): void {
    requestAnimationFrame((next) => this.frame(next));
    this.screen.add(nowMs);
    const { state, session, player } = this;
    setAttribute(this.stage, 'data-main', state.main);
    this.showSheet();
    if (player.draw()) {
      this.measure();
      this.element.dataset['firstPictureMs'] ??= performance.now().toFixed(0);
      this.loadMap();
    }
    this.hand.tickDrags();
    this.video.draw();
    this.map.draw(nowMs, this.screen.rate(nowMs));
    this.placeInset(nowMs);
    state.expire(nowMs);
    this.meet();
    this.notice.update(nowMs);
    this.pilot.check();
    const version = [
      ...[state.version, session.annotations.changes, session.link.kind],
      ...[this.pilot.version, gazeKey(session.gaze), session.talk.version, session.scene.version],
    ].join();
    if (version === this.panelsVersion && nowMs - this.panelsMs < PANEL_MS) return;
    this.panelsVersion = version;
    this.panelsMs = nowMs;
    this.element.dataset['link'] = session.link.kind;
    this.header.update(session, player, this.meter);
    this.strip.update(session, this.meter, this.screen.rate(nowMs), this.record.problem);
    this.record.update(nowMs);
    const on = { follow: this.map.map?.following ?? false, freeze: this.video.frozen };
    this.tools.update(state, on, (name) => (CHANGES.has(name) ? whyNotEdit(session) : undefined));
    this.element.dataset['overlayMs'] =
      `${median(this.video.overlayMs)} ${median(this.map.overlayMs)}`;
    this.annotations.update();
    this.sheets.update(session.annotations.list().length, this.talk.unread);
    this.talk.update();
    this.firstTask.update();
    this.gaze.update();
    this.thingsPanel.update();
    setClass(this.element, 'no-head', !hasHead(session.gaze));
    if (hasHead(session.gaze)) this.pilot.warm();
  }

  /** Who sits here, as the server has it; new marks have the person's colour until another is chosen. */
  private meet(): void {
    const { state, session } = this;
    const me = session.participants.find((each) => each.participantId === session.participantId);
    this.askName(me);
    state.me = { name: me?.name ?? session.displayName, personId: personIdOf(session) };
    const colour = session.joined?.colorRgba ?? 0;
    if (state.colourChosen || colour === 0 || colour === state.colorRgba) return;
    state.colorRgba = colour;
    state.changed();
  }

  /** The video keeps off the wearer's camera in the map. */
  private placeInset(nowMs: number): void {
    const camera = this.state.main === 'map' ? this.map.cameraAt() : undefined;
    const corner = this.inset.update(nowMs, camera, this.map.shape, this.video.shape);
    if (this.stage.dataset['corner'] !== corner) this.stage.dataset['corner'] = corner;
  }

  private measure(): void {
    const { shown } = this.player;
    if (!shown) return;
    const { facts, decodedMs, drawnMs } = shown;
    const times = stageTimes(facts, decodedMs, drawnMs, this.session.clock.offsetMs);
    if (times) this.meter.add(times);
  }
}
