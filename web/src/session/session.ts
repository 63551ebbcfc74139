import type { AccessUnit } from '../gen/saccade/v1/video_pb';
import { VideoView } from '../gen/saccade/v1/video_pb';
import type { Event, JoinResponse } from '../gen/saccade/v1/session_pb';
import type { Clients } from '../transport/clients';
import { Backoff } from '../transport/backoff';
import { isRefusal, isReplaced, streamEndWords } from '../transport/errors';
import { acknowledge } from './acknowledge';
import type { Acknowledger } from './acknowledger';
import { AnnotationBook } from './annotation_book';
import { ClockOffset, pageNowMs, ping } from './clock';
import { toParticipant, toPose, toStatistics } from './convert';
import { FrameReader } from './frame_reader';
import type { Gaze } from './gaze';
import { toGaze } from './gaze_convert';
import { Joining } from './joining';
import { MapState } from './map_state';
import { follow } from './path';
import type { PictureSink } from './picture_sink';
import { PointerBook } from './pointers';
import { FrameRing } from './ring';
import { SceneBook } from './scene_book';
import type { SessionOptions } from './session_options';
import { silenceWords } from './silence';
import { sleep } from './sleep';
import { SurfaceBook } from './surface_book';
import { TalkState } from './talk_state';
import type { FrameFacts, Link, Participant, Pose, Scale, Statistics } from './types';

const WINDOW = 32;
const SILENCE_MS = 4000; // statistics come every second
const PING_MS = 1000;

/**
 * One person's session: joins, subscribes, keeps what the stream tells, joins again when the server
 * went away. Knows no DOM and no three.js; whoever shows it reads its fields once per screen frame.
 */
export class Session {
  link: Link = { kind: 'connecting' };
  joined: JoinResponse | undefined;
  pose: Pose | undefined;
  poseMs = 0; // when that came, this page's clock
  sourceEnded = false;
  participants: readonly Participant[] = [];
  statistics: Statistics | undefined;
  gaze: Gaze | undefined;
  readonly map = new MapState();
  readonly annotations = new AnnotationBook();
  readonly pointers = new PointerBook();
  readonly frames = new FrameRing<FrameFacts>(300);
  readonly path: Pose[] = [];
  readonly clock = new ClockOffset();
  readonly talk = new TalkState();
  readonly scene = new SceneBook();
  readonly surface = new SurfaceBook();
  private readonly reader = new FrameReader();
  private heardMs = 0; // when the stream last told something; 0: not yet
  private lastEventMs = 0;
  private acknowledger: Acknowledger | undefined;
  private readonly backoff = new Backoff();
  private attempt: AbortController | undefined;
  private renamed = false;
  private readonly joining: Joining;
  private ended = ''; // why we ended the attempt ourselves
  private watchedMs = 0;

  constructor(
    readonly clients: Clients,
    private readonly options: SessionOptions,
    private readonly pictures: PictureSink,
  ) {
    this.joining = new Joining(clients.session, options);
  }

  /** What others call this page. */
  get displayName(): string {
    return this.joining.name;
  }

  /** What others know this page by: as pilot, and in presence. */
  get participantId(): string {
    return this.joined?.participantId ?? '';
  }

  get sessionId(): string {
    return this.joined?.sessionId ?? '';
  }

  get scale(): Scale {
    const { pose } = this;
    return { metric: pose?.metric ?? false, eye: pose?.worldFromCamera.translation };
  }

  /** How old everything shown is [ms]; undefined while it is live, and before the first of it. */
  get ageMs(): number | undefined {
    return this.live || this.heardMs === 0 ? undefined : pageNowMs() - this.heardMs;
  }

  /** True when requests can be expected to be answered. */
  get live(): boolean {
    return this.link.kind === 'live';
  }

  /** The name the others see, from now on: joins anew, as a name belongs to a session. */
  rename(name: string): void {
    if (name === this.joining.name) return;
    this.joining.rename(name);
    this.renamed = true;
    this.attempt?.abort();
  }

  /** Whether this page hears voices: subscribes anew, in the same session. */
  listen(listens: boolean): void {
    if (this.talk.listens === listens) return;
    this.talk.listens = listens;
    this.renamed = true;
    this.attempt?.abort();
  }

  /** A frame of the server's ring as PNG, as it was kept: grey without loss. */
  async fetchPng(frameId: number): Promise<Uint8Array<ArrayBuffer>> {
    const request = { frameId: BigInt(frameId), view: VideoView.RAW };
    const { png } = await this.clients.session.getFrame(request, { timeoutMs: 5000 });
    return new Uint8Array(png);
  }

  requestKeyFrame(): void {
    this.acknowledger?.requestKeyFrame();
  }

  /** The decoder has done a picture: what was held back may go on. */
  decoded(): void {
    this.acknowledger?.flush(WINDOW / 4);
  }

  /** Runs until `signal` says stop. */
  async run(signal: AbortSignal): Promise<void> {
    while (!signal.aborted) {
      const attempt = new AbortController();
      this.attempt = attempt;
      this.renamed = false;
      const stop = (): void => attempt.abort();
      signal.addEventListener('abort', stop);
      try {
        await this.runOnce(attempt);
        this.lost('the server ended the stream');
      } catch (error) {
        if (isRefusal(error)) {
          this.link = { kind: 'refused', reason: streamEndWords(error) };
          return;
        }
        const ours = attempt.signal.aborted;
        // Another tab goes on with this session: leave it to that one, or both would never end it.
        if (!ours && isReplaced(error)) this.joining.forget();
        this.lost(ours ? this.ended : streamEndWords(error));
      } finally {
        attempt.abort();
        signal.removeEventListener('abort', stop);
      }
      if (this.joinsAnew()) this.link = { kind: 'connecting' };
      else await sleep(this.backoff.nextMs(), signal);
    }
  }

  /** True once after a new name: nothing was lost. */
  private joinsAnew(): boolean {
    const { renamed } = this;
    this.renamed = false;
    return renamed;
  }

  private lost(reason: string): void {
    const sinceMs = this.link.kind === 'reconnecting' ? this.link.sinceMs : pageNowMs();
    this.link = { kind: 'reconnecting', reason, sinceMs };
  }

  private async runOnce(attempt: AbortController): Promise<void> {
    const { signal } = attempt;
    const { view, topics = [] } = this.options;
    await this.options.enter?.(signal, this.displayName, () => (this.link = { kind: 'waiting' }));
    const joined = await this.joining.join(
      signal,
      (tabs) => (this.link = { kind: 'crowded', tabs }),
    );
    if (signal.aborted) return;
    this.begin(joined, signal);
    const timers = [
      setInterval(() => this.watch(attempt), 500),
      setInterval(() => void this.ping(signal), PING_MS),
      setInterval(() => this.acknowledger?.flush(), 100),
    ];
    try {
      void this.ping(signal);
      void this.surface.follow(this.clients.surface, joined.sessionId, signal);
      void this.talk.catchUp(this.clients.talk, joined.sessionId, signal);
      const stream = this.clients.session.subscribe(
        {
          sessionId: joined.sessionId,
          window: WINDOW,
          topics: this.talk.topics(topics),
          videoView: view === 'raw' ? VideoView.RAW : VideoView.AUGMENTED,
        },
        { signal },
      );
      for await (const event of stream) this.receive(event);
    } finally {
      timers.forEach(clearInterval);
    }
  }

  private begin(joined: JoinResponse, signal: AbortSignal): void {
    this.joined = joined;
    this.lastEventMs = this.watchedMs = pageNowMs();
    this.sourceEnded = false;
    this.gaze = undefined;
    this.pointers.clear();
    this.frames.clear();
    this.path.length = 0;
    this.clock.reset();
    this.pictures.reset();
    const { clients, pictures } = this;
    const client = clients.session;
    this.acknowledger = acknowledge({ client, joined, pictures, every: WINDOW / 4 }, signal);
  }

  /** A stream that is silent without having ended: the machine or the network went away. */
  private watch(attempt: AbortController): void {
    const nowMs = pageNowMs();
    const [silentMs, asleepMs] = [nowMs - this.lastEventMs, nowMs - this.watchedMs];
    this.watchedMs = nowMs;
    if (silentMs > SILENCE_MS) this.ended = silenceWords(silentMs, asleepMs);
    else if (this.options.tabs?.mayStream === false) this.ended = 'older tabs go first';
    else return;
    attempt.abort();
  }

  private ping(signal: AbortSignal): Promise<void> {
    return ping(this.clients.session, this.clock, signal);
  }

  private receive({ sequence, event }: Event): void {
    this.heardMs = this.lastEventMs = pageNowMs();
    this.link = { kind: 'live' };
    this.backoff.reset();
    switch (event.case) {
      case 'accessUnit':
        this.receivePicture(event.value);
        break;
      case 'pose':
        this.receivePose(toPose(event.value));
        break;
      case 'map':
        this.map.apply(event.value);
        break;
      case 'annotation':
        this.annotations.apply(event.value);
        break;
      case 'presence':
        this.participants = event.value.participants.map(toParticipant);
        break;
      case 'statistics':
        this.statistics = toStatistics(event.value);
        break;
      case 'endOfSource':
        this.sourceEnded = true;
        break;
      case 'gaze':
        this.gaze = toGaze(event.value);
        break;
      case 'pointer':
        this.pointers.apply(event.value, this.participantId, this.lastEventMs);
        break;
      case 'surface':
        this.surface.apply(event.value);
        break;
      case 'scene':
        this.scene.apply(event.value, this.clients.scene, this.sessionId);
        break;
      default:
        this.talk.receive(event);
    }
    this.acknowledger?.arrived(sequence);
  }

  private receivePicture(unit: AccessUnit): void {
    const facts = this.reader.read(unit, this.joined?.intrinsics, this.lastEventMs);
    if (facts) this.frames.set(facts.frameId, facts);
    if (facts) this.pictures.decode(facts, unit);
  }

  private receivePose(pose: Pose): void {
    follow(this.path, this.pose, pose);
    this.pose = pose;
    this.poseMs = this.lastEventMs;
  }
}
