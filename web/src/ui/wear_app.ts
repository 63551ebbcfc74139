import { uprightView } from '../geometry/turned_view';
import type { Pixel } from '../geometry/vec3';
import { projectPoint } from '../geometry/view';
import type { CameraIntrinsics } from '../gen/saccade/v1/geometry_pb';
import type { WearerTracked } from '../gen/saccade/v1/wearer_pb';
import { edgeArrowsOf } from '../scene/edge_arrows';
import { strokesOf } from '../scene/strokes';
import { pageNowMs } from '../session/clock';
import { toIntrinsics, toPose } from '../session/convert';
import { RateMeter } from '../session/latency';
import { newUuid } from '../session/uuid';
import type { Session } from '../session/session';
import { isPlaced, type Pose } from '../session/types';
import { VoiceRoom } from '../talk/voice_room';
import { CameraStream } from '../uplink/camera';
import { watchMotion } from '../uplink/motion';
import type { Sent } from '../uplink/sent';
import { Uplink } from '../uplink/socket';
import { WearCamera } from '../uplink/wear_camera';
import { WEAR_STAGES, WearMeter, wearTimes } from '../uplink/wear_latency';
import { Chime } from './chime';
import { storage } from './dom';
import { allMarks } from './marks';
import { NewsWatch } from './news';
import { Painter } from './painter';
import { PauseControl } from './pause_control';
import { WearScreen } from './wear_screen';
import { latencyWords, wearWords } from './wear_words';
import { presenceWords, statusWords } from './words';

const SHOWN_MS = 400; // without a tracked picture for so long, the camera's own is shown
const NEWS_MS = 1500; // how long news is lit
const PHONE = 'saccade.phone';

/** This phone is the camera: its pictures go to the server, and come back as marks over them. */
export class WearApp {
  readonly element: HTMLElement;
  private readonly screen = new WearScreen();
  private readonly painter = new Painter();
  private readonly camera: WearCamera;
  private readonly pause: PauseControl;
  private readonly room: VoiceRoom;
  private readonly chime = new Chime();
  private readonly watch: NewsWatch;
  private uplink: Uplink | undefined;
  private intrinsics: CameraIntrinsics | undefined;
  private next: { tracked: WearerTracked; arrivedMs: number } | undefined;
  private pose: Pose | undefined;
  private trackedMs = 0;
  private started = false;
  private watchesMotion = false;
  private readonly latency = new WearMeter();
  private readonly rate = new RateMeter();

  constructor(
    private readonly session: Session,
    private readonly token: () => string,
  ) {
    this.camera = new WearCamera(() => this.uplink, pageNowMs);
    this.element = this.screen.element;
    this.screen.picture.after(this.painter.canvas);
    this.screen.start.addEventListener('click', () => void this.begin());
    this.pause = new PauseControl(session);
    this.screen.pause.addEventListener('click', () => this.pause.toggle());
    this.room = new VoiceRoom(session);
    this.watch = new NewsWatch(session, () => this.chime.play());
    this.screen.voice.addEventListener('click', () => {
      if (this.room.state === 'off') void this.room.join();
      else this.room.leave();
    });
    this.screen.mute.addEventListener('click', () => this.room.toggleMute());
    this.screen.lens.addEventListener('change', () => {
      this.camera.deviceId = this.screen.lens.value;
      void this.openCamera();
    });
    document.addEventListener('visibilitychange', () => {
      if (document.hidden || !this.started) return;
      void this.stayAwake();
      void this.camera.resume();
      this.uplink?.hurry();
    });
    window.addEventListener('online', () => this.uplink?.hurry());
  }

  start(): void {
    requestAnimationFrame(() => this.frame());
  }

  /** By a tap: browsers ask for camera, motion and an awake screen only then. */
  private async begin(): Promise<void> {
    this.started = true;
    void this.stayAwake();
    const motion = this.watchMotion();
    await this.openCamera();
    await motion;
  }

  /** Once, whatever is tapped again; after a refusal, asks again. */
  private async watchMotion(): Promise<void> {
    if (this.watchesMotion) return;
    this.watchesMotion = true; // before it has answered: taps are quick
    this.watchesMotion = await watchMotion((sample) => this.uplink?.sendMotion(sample));
  }

  private async openCamera(): Promise<void> {
    await this.camera.start();
    if (this.camera.state.kind !== 'on') return;
    this.screen.setLenses(await CameraStream.lenses(), this.camera.label);
  }

  private async stayAwake(): Promise<void> {
    if (!('wakeLock' in navigator)) return;
    await navigator.wakeLock.request('screen').catch(() => undefined); // low battery: then not
  }

  /** Once the session was joined: then the invite is redeemed, and there is a token. */
  private connect(): void {
    if (this.uplink || !this.session.live || this.camera.state.kind !== 'on') return;
    const url = new URL('/wear/upstream', location.href);
    url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
    this.uplink = new Uplink({
      url: url.href,
      token: this.token,
      phoneId: phoneId(),
      cameraLabel: () => this.camera.label,
      nowMs: pageNowMs,
      answers: (signal) => fetch(location.pathname, { method: 'HEAD', cache: 'no-store', signal }),
      events: {
        welcome: ({ width, height, fpsHz, intrinsics }) => {
          this.intrinsics = intrinsics;
          this.latency.clear();
          this.camera.linked({ width, height }, fpsHz);
        },
        tracked: (tracked, arrivedMs) => {
          this.camera.trackedId = Math.max(this.camera.trackedId, Number(tracked.pictureId));
          this.next = { tracked, arrivedMs };
        },
        keyFrameWanted: () => this.camera.requestKeyFrame(),
      },
    });
  }

  private frame(): void {
    requestAnimationFrame(() => this.frame());
    this.connect();
    this.watch.update();
    this.draw();
    this.update();
  }

  private draw(): void {
    const { next } = this;
    this.next = undefined;
    const sent = next && this.camera.sent.find(Number(next.tracked.pictureId));
    const { newest } = this.camera.sent;
    if (next && sent) {
      this.pose = next.tracked.pose && toPose(next.tracked.pose);
      this.show(sent, this.pose);
      this.measure(sent, next.tracked, next.arrivedMs);
    } else if (newest && pageNowMs() - this.trackedMs > SHOWN_MS) {
      this.show(newest, undefined);
    }
  }

  /** The picture with the marks that belong to it; without a pose, without. */
  private show(sent: Sent, pose: Pose | undefined): void {
    const rect = this.screen.show(sent.picture);
    // Hidden as well as cleared: in Chromium on a software GPU what was cleared stayed on the screen.
    this.painter.canvas.style.visibility = isPlaced(pose) ? '' : 'hidden';
    const { clientWidth, clientHeight } = this.element;
    this.painter.begin({ width: clientWidth, height: clientHeight }, rect);
    this.painter.clip(sent.size.width, sent.size.height);
    if (isPlaced(pose) && this.intrinsics) {
      const lens = toIntrinsics(this.intrinsics);
      const view = uprightView(lens, pose.worldFromCamera, sent.turn);
      const eye = pose.worldFromCamera.translation;
      const marks = allMarks(this.session.annotations, { metric: pose.metric, eye });
      this.painter.marks(strokesOf(view, marks), []);
      this.painter.edgeArrows(edgeArrowsOf(view, marks), []);
      this.tellMarks(marks.map(({ pointInWorld }) => projectPoint(view, pointInWorld)));
    }
    this.painter.end();
    this.screen.picture.dataset['frameId'] = pose ? String(pose.frameId) : '';
    this.painter.canvas.dataset['frameId'] = pose ? String(pose.frameId) : '';
  }

  private measure(sent: Sent, tracked: WearerTracked, arrivedMs: number): void {
    const drawnMs = pageNowMs();
    if (this.trackedMs < drawnMs) this.rate.add(drawnMs);
    this.trackedMs = drawnMs;
    const { offsetMs } = this.session.clock;
    if (offsetMs === undefined) return;
    this.latency.add(wearTimes(sent, tracked, arrivedMs, drawnMs, offsetMs));
  }

  private update(): void {
    const { session, uplink, camera } = this;
    const nowMs = pageNowMs();
    const { link, sourceEnded } = session;
    const status = statusWords({ link: { kind: 'live' }, pose: this.pose, sourceEnded, nowMs });
    const words = wearWords({
      link,
      uplink: uplink?.state,
      camera: camera.state,
      paused: this.pause.paused,
      problem: this.pause.problem || this.room.problem || (uplink?.problem ?? ''),
      untrackedMs: nowMs - this.trackedMs,
      tracking: {
        text: [`${status.mark} ${status.text}`, status.advice].filter(Boolean).join(': '),
        warn: status.warn,
      },
      nowMs,
    });
    const held = camera.held.encoder + camera.held.network + camera.held.server;
    const { newest } = this.watch;
    this.screen.update({
      words,
      started: this.started && camera.state.kind !== 'failed',
      refused: link.kind === 'refused' || uplink?.state.kind === 'refused',
      failure: camera.state.kind === 'failed' ? camera.state.reason : '',
      paused: this.pause.paused,
      watchers: session.live
        ? presenceWords(session.participants.filter(({ role }) => role !== 'wearer')) ||
          'nobody watches'
        : '',
      latency: latencyWords(
        this.latency.percentile('total', 0.5),
        this.rate.rate(nowMs),
        camera.codecWords,
        held,
      ),
      voice: {
        open: this.room.state !== 'off',
        microphone: this.room.hasMicrophone,
        muted: this.room.muted,
      },
      news: newest?.text ?? '',
      lit: newest !== undefined && performance.now() - newest.atMs < NEWS_MS,
    });
    this.tellTests(held);
  }

  /** Where the marks are in the picture that is shown [px], for whoever measures this page. */
  private tellMarks(pixels: readonly (Pixel | undefined)[]): void {
    const words = pixels.map((at) => (at ? `${at.u.toFixed(2)} ${at.v.toFixed(2)}` : ''));
    this.painter.canvas.dataset['marks'] = words.join(',');
  }

  /** Figures of the last pictures, for whoever measures this page. */
  private tellTests(held: number): void {
    const { dataset } = this.element;
    dataset['uplink'] = this.uplink?.state.kind ?? 'none';
    dataset['held'] = String(held);
    dataset['heard'] = this.room.figures;
    const stages = [...WEAR_STAGES, 'total' as const].map((stage) => {
      const at = (q: number): number => Math.round(this.latency.percentile(stage, q) ?? -1);
      return `${stage} ${at(0.5)}/${at(0.95)}`;
    });
    dataset['latency'] = stages.join(', ');
  }
}

/** The same in every tab of this phone: a new one takes over from one whose link is dead. */
function phoneId(): string {
  const kept = storage();
  const id = kept.getItem(PHONE) ?? newUuid();
  try {
    kept.setItem(PHONE, id);
  } catch {
    // Full: then this tab alone knows it.
  }
  return id;
}
