import type { AccessUnit } from '../gen/saccade/v1/video_pb';
import { VideoView } from '../gen/saccade/v1/video_pb';
import type { Event, JoinResponse } from '../gen/saccade/v1/session_pb';
import { Camera } from '../geometry/camera';
import type { Clients } from '../transport/clients';
import { Backoff } from '../transport/backoff';
import { describeError, isRefusal } from '../transport/errors';
import { Acknowledger } from './acknowledger';
import { AnnotationBook } from './annotation_book';
import { ClockOffset, pageNowMs, wireTimes } from './clock';
import { pbRoles, toIntrinsics, toParticipant, toPose, toStages } from './convert';
import type { Gaze } from './gaze';
import { toGaze } from './gaze_convert';
import { MapState } from './map_state';
import { FrameRing } from './ring';
import {
  type FrameFacts,
  isPlaced,
  type Link,
  type Participant,
  type Pose,
  type Role,
} from './types';
import type { Statistics, View } from './types';

/** Where coded pictures go. */
export interface PictureSink {
  decode(facts: FrameFacts, unit: AccessUnit): void;
  /** A new subscription begins: the next unit is a key frame. */
  reset(): void;
  /** True while so much waits to be decoded that no more should come. */
  readonly behind: boolean;
}

export interface SessionOptions {
  readonly role: Role;
  readonly view: View;
  readonly name: string;
}

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
  sourceEnded = false;
  participants: readonly Participant[] = [];
  statistics: Statistics | undefined;
  gaze: Gaze | undefined;
  readonly map = new MapState();
  readonly annotations = new AnnotationBook();
  readonly frames = new FrameRing<FrameFacts>(300);
  readonly path: Pose[] = [];
  readonly clock = new ClockOffset();
  private camera: Camera | undefined;
  private lastEventMs = 0;
  private acknowledger: Acknowledger | undefined;
  private readonly backoff = new Backoff();
  private attempt: AbortController | undefined;
  private name: string;
  private renamed = false;

  constructor(
    readonly clients: Clients,
    private readonly options: SessionOptions,
    private readonly pictures: PictureSink,
  ) {
    this.name = options.name;
  }

  /** What others know this page by: as pilot, and in presence. */
  get participantId(): string {
    return this.joined?.participantId ?? '';
  }

  get sessionId(): string {
    return this.joined?.sessionId ?? '';
  }

  /** True when requests can be expected to be answered. */
  get live(): boolean {
    return this.link.kind === 'live';
  }

  /** The name the others see, from now on: joins anew, as a name belongs to a session. */
  rename(name: string): void {
    if (name === this.name) return;
    this.name = name;
    this.renamed = true;
    this.attempt?.abort();
  }

  /** A frame of the server's ring as PNG, without loss, as captured. */
  async fetchPng(frameId: number): Promise<Uint8Array<ArrayBuffer>> {
    const request = { frameId: BigInt(frameId), view: VideoView.RAW };
    const { png } = await this.clients.session.getFrame(request, { timeoutMs: 5000 });
    return new Uint8Array(png);
  }

  requestKeyFrame(): void {
    this.acknowledger?.requestKeyFrame();
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
          this.link = { kind: 'refused', reason: describeError(error) };
          return;
        }
        const reason = attempt.signal.aborted ? 'no data for 4 s' : describeError(error);
        this.lost(reason);
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
    const { role, view } = this.options;
    const joined = await this.clients.session.join(
      { displayName: this.name, role: pbRoles[role] },
      { signal, timeoutMs: 5000 },
    );
    this.begin(joined, signal);
    const timers = [
      setInterval(() => this.watch(attempt), 500),
      setInterval(() => void this.ping(signal), PING_MS),
      setInterval(() => this.acknowledger?.flush(), 100),
    ];
    try {
      void this.ping(signal);
      const stream = this.clients.session.subscribe(
        {
          sessionId: joined.sessionId,
          window: WINDOW,
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
    this.lastEventMs = pageNowMs();
    this.sourceEnded = false;
    this.gaze = undefined;
    this.frames.clear();
    this.path.length = 0;
    this.clock.reset();
    this.pictures.reset();
    this.acknowledger = new Acknowledger({
      every: WINDOW / 4,
      mayProceed: () => !this.pictures.behind,
      send: async (sequence, requestKeyFrame) => {
        await this.clients.session.acknowledge(
          { sessionId: joined.sessionId, sequence, requestKeyFrame },
          { signal, timeoutMs: 3000 },
        );
      },
    });
  }

  /** A stream that is silent without having ended: the machine or the network went away. */
  private watch(attempt: AbortController): void {
    if (pageNowMs() - this.lastEventMs > SILENCE_MS) attempt.abort();
  }

  private async ping(signal: AbortSignal): Promise<void> {
    const sent = pageNowMs();
    try {
      const reply = await this.clients.session.ping(
        { clientSendNs: BigInt(Math.round(sent * 1e6)) },
        { signal, timeoutMs: 2000 },
      );
      const t1 = Number(reply.serverReceiveNs) / 1e6;
      const t2 = Number(reply.serverSendNs) / 1e6;
      const answered = pageNowMs();
      await sleep(20, signal); // the browser records a request shortly after it has ended
      const wire = wireTimes('/Ping', sent);
      this.clock.add(wire?.sentMs ?? sent, t1, t2, wire?.answeredMs ?? answered);
    } catch {
      // The stream's silence says the same, and says it to the reader.
    }
  }

  private receive({ sequence, event }: Event): void {
    this.lastEventMs = pageNowMs();
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
        this.statistics = {
          capturedFps: event.value.capturedFpsHz,
          trackedFps: event.value.trackedFpsHz,
          encodedFps: event.value.encodedFpsHz,
          framesDropped: Number(event.value.framesDropped),
          badFrames: Number(event.value.badFrames),
          eventsSkipped: Number(event.value.eventsSkipped),
          videoBitRate: event.value.videoBitRateBitS,
        };
        break;
      case 'endOfSource':
        this.sourceEnded = true;
        break;
      case 'gaze':
        this.gaze = toGaze(event.value);
        break;
      case undefined:
        break;
    }
    this.acknowledger?.arrived(sequence);
  }

  private receivePicture(unit: AccessUnit): void {
    const pb = unit.intrinsics ?? this.joined?.intrinsics;
    if (!pb) return;
    const intrinsics = toIntrinsics(pb);
    if (!this.camera || JSON.stringify(this.camera.intrinsics) !== JSON.stringify(intrinsics)) {
      this.camera = new Camera(intrinsics);
    }
    const facts: FrameFacts = {
      frameId: Number(unit.frameId),
      view: unit.view === VideoView.AUGMENTED ? 'augmented' : 'raw',
      pose: unit.pose && toPose(unit.pose),
      camera: this.camera,
      stages: toStages(unit.stages),
      arrivedMs: this.lastEventMs,
    };
    this.frames.set(facts.frameId, facts);
    this.pictures.decode(facts, unit);
  }

  private receivePose(pose: Pose): void {
    if (this.pose && pose.mapRevision !== this.pose.mapRevision) this.path.length = 0;
    this.pose = pose;
    if (!isPlaced(pose)) return;
    this.path.push(pose);
    if (this.path.length > 9000) this.path.splice(0, 3000);
  }
}

function sleep(ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, ms);
    signal.addEventListener('abort', () => {
      clearTimeout(timer);
      resolve();
    });
  });
}
