import { Edits } from '../session/edits';
import { gazeKey, hasHead } from '../session/gaze';
import { GazePilot } from '../session/gaze_pilot';
import { LatencyMeter, RateMeter, stageTimes } from '../session/latency';
import type { Session } from '../session/session';
import { WorkerKeeping } from '../transport/lease_keeper';
import { AnnotationsPanel } from './annotations_panel';
import { AppState } from './app_state';
import { Controller } from './controller';
import { h, setClass } from './dom';
import { FirstTask } from './first_task';
import { GazeController } from './gaze_controller';
import { GazePanel } from './gaze_panel';
import { HandoverNotice } from './handover_notice';
import { Header } from './header';
import { Help } from './help';
import { InsetCorner } from './inset';
import { handleKeys } from './keys';
import { MapPane } from './map_pane';
import { Notes } from './notes';
import type { Player } from './player';
import { handleMapPointer, handleVideoPointer } from './pointer';
import { Sheets } from './sheets';
import { Strip } from './strip';
import { handleTalkKeys } from './talk_keys';
import { TalkPanel } from './talk_panel';
import { ToolNames } from './tool_names';
import { ToolsColumn } from './tools_column';
import { VideoPane } from './video_pane';

const MAP_AT_LATEST_MS = 1500;
const PANEL_MS = 200; // moving numbers change five times a second: readable

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
  private readonly talk: TalkPanel;
  private readonly firstTask: FirstTask;
  private readonly stage = h('main', {});
  private mapLoading = false;
  private panelsMs = 0;
  private panelsVersion = '';

  constructor(
    private readonly session: Session,
    private readonly player: Player,
    token: () => string,
  ) {
    const { state } = this;
    this.map = new MapPane(session, player, state);
    this.video = new VideoPane(session, player, state);
    this.pilot = new GazePilot(session, new WorkerKeeping(location.origin, token));
    const gaze = new GazeController(session, this.pilot, state);
    const edits = new Edits(session);
    const notes = new Notes(session, edits, state);
    const controller = new Controller(session, edits, state, this.map, this.video, gaze, notes);
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
    new ToolNames(this.tools.element);
    this.stage.append(this.map.element, this.video.element, this.notice.element);
    this.stage.append(this.firstTask.element);
    this.element = h('div', { class: 'app' });
    this.element.append(
      this.header.element,
      this.tools.element,
      this.stage,
      h('div', { class: 'side' }, this.annotations.element, this.gaze.element, this.talk.element),
      this.strip.element,
      this.sheets.element,
      this.help.dialog,
    );
    notes.listen();
    handleMapPointer(this.map, controller.mapGestures());
    handleVideoPointer(this.video.element, controller.videoGestures());
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

  private loadMap(): void {
    if (this.mapLoading) return;
    this.mapLoading = true;
    void this.map.load();
  }

  private frame(nowMs: number): void {
    requestAnimationFrame((next) => this.frame(next));
    this.screen.add(nowMs);
    const { state, session, player } = this;
    this.stage.dataset['main'] = state.main;
    this.showSheet();
    if (player.draw()) {
      this.measure();
      this.element.dataset['firstPictureMs'] ??= performance.now().toFixed(0);
      this.loadMap();
    }
    this.video.draw();
    this.map.draw(nowMs, this.screen.rate(nowMs));
    this.placeInset(nowMs);
    state.expire(nowMs);
    const me = session.participants.find((each) => each.participantId === session.participantId);
    state.myName = me?.name ?? session.displayName;
    this.notice.update(nowMs);
    this.pilot.check();
    const version = [
      ...[state.version, session.annotations.version, session.link.kind],
      ...[this.pilot.version, gazeKey(session.gaze), session.talk.version],
    ].join();
    if (version === this.panelsVersion && nowMs - this.panelsMs < PANEL_MS) return;
    this.panelsVersion = version;
    this.panelsMs = nowMs;
    this.element.dataset['link'] = session.link.kind;
    this.header.update(session, player, this.meter);
    this.strip.update(session, this.meter, this.screen.rate(nowMs));
    this.tools.update(state, {
      follow: this.map.map?.following ?? false,
      freeze: this.video.frozen,
    });
    this.annotations.update();
    this.sheets.update(session.annotations.list().length, this.talk.unread);
    this.talk.update();
    this.firstTask.update();
    this.gaze.update();
    setClass(this.element, 'no-head', !hasHead(session.gaze));
    if (hasHead(session.gaze)) this.pilot.warm();
  }

  /** The video keeps off the wearer's camera in the map. */
  private placeInset(nowMs: number): void {
    const { clientWidth: width, clientHeight: height } = this.video.element;
    const { element } = this.map;
    const pane = { width: element.clientWidth, height: element.clientHeight };
    const camera = this.state.main === 'map' ? this.map.cameraAt() : undefined;
    this.stage.dataset['corner'] = this.inset.update(nowMs, camera, pane, { width, height });
  }

  private measure(): void {
    const { shown } = this.player;
    if (!shown) return;
    const { facts, decodedMs, drawnMs } = shown;
    const times = stageTimes(facts, decodedMs, drawnMs, this.session.clock.offsetMs);
    if (times) this.meter.add(times);
  }
}
