import { create, fromBinary, type MessageInitShape, toBinary } from '@bufbuild/protobuf';
import {
  type WearerDownstream,
  WearerDownstreamSchema,
  type WearerTracked,
  WearerUpstreamSchema,
  type WearerWelcome,
} from '../gen/saccade/v1/wearer_pb';
import { Backoff } from '../transport/backoff';
import type { Coded } from './coder';
import type { Motion } from './motion';
import type { Turn } from './turn';

export type UplinkState =
  | { readonly kind: 'connecting' }
  | { readonly kind: 'live' }
  | { readonly kind: 'reconnecting'; readonly reason: string; readonly sinceMs: number }
  | { readonly kind: 'refused'; readonly reason: string };

export interface UplinkEvents {
  welcome(welcome: WearerWelcome): void;
  tracked(tracked: WearerTracked, arrivedMs: number): void;
  keyFrameWanted(): void;
}

/** What a link needs of the browser; tests bring their own. */
export interface UplinkOptions {
  readonly url: string;
  readonly token: () => string;
  readonly phoneId: string;
  readonly cameraLabel: () => string;
  readonly events: UplinkEvents;
  readonly nowMs: () => number; // performance.timeOrigin + now()
  readonly makeSocket?: (url: string) => WebSocket;
  /** Settles when the server answers anything at all; absent: only the WebSocket is tried. */
  readonly answers?: (signal: AbortSignal) => Promise<unknown>;
  readonly random?: () => number;
}

const CONNECT_MS = 3000; // a dead network says nothing
const MOST_PAUSE_MS = 1000; // the camera is what everybody waits for
const PING_MS = 1000;
const SILENCE_MS = 4000;
// Browsers make WebSockets wait up to 5 s once some have failed: with no network, none are spent.
const FAILURES_BEFORE_ASKING = 2;

const ns = (ms: number): bigint => BigInt(Math.round(ms * 1e3)) * 1000n;

/**
 * The link to the server, which is made anew until it is refused for good: after pauses of 0.25 s
 * that grow to 1 s, and at once when the network is back.
 */
export class Uplink {
  state: UplinkState = { kind: 'connecting' };
  /** What the server says of the pictures that come; empty: nothing is wrong. */
  problem = '';
  private socket: WebSocket | undefined;
  private heardMs = 0;
  private echo = { serverNs: 0n, arrivedMs: 0 };
  private readonly backoff: Backoff;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private readonly ticking: ReturnType<typeof setInterval>;
  private stopped = false;
  private failures = 0; // since the last welcome
  private asking: AbortController | undefined;

  constructor(private readonly options: UplinkOptions) {
    this.backoff = new Backoff(options.random, MOST_PAUSE_MS);
    this.ticking = setInterval(() => this.tick(), PING_MS);
    this.connect();
  }

  get live(): boolean {
    return this.state.kind === 'live';
  }

  get bufferedBytes(): number {
    return this.socket?.bufferedAmount ?? 0;
  }

  /** True: on its way. */
  sendPicture(pictureId: number, capturedMs: number, coded: Coded, turn: Turn): boolean {
    return this.send({
      message: {
        case: 'picture',
        value: {
          pictureId: BigInt(pictureId),
          codec: coded.codec,
          keyFrame: coded.keyFrame,
          captureNs: ns(capturedMs),
          width: coded.size.width,
          height: coded.size.height,
          clockwiseDeg: turn,
          encodedNs: ns(this.options.nowMs()),
          data: coded.data,
        },
      },
    });
  }

  sendMotion({ timeMs, acceleration, angularVelocity }: Motion): void {
    if (this.bufferedBytes > 16_384) return; // pictures first
    const vector = ([x, y, z]: readonly [number, number, number]) => ({ x, y, z });
    this.send({
      message: {
        case: 'motion',
        value: {
          timeNs: ns(timeMs),
          accelerationMS2: vector(acceleration),
          angularVelocityRadS: vector(angularVelocity),
        },
      },
    });
  }

  /** The network or the page is back: no use in waiting longer. */
  hurry(): void {
    if ((this.timer === undefined && !this.asking) || this.stopped) return;
    clearTimeout(this.timer);
    this.connect();
  }

  stop(): void {
    this.stopped = true;
    clearInterval(this.ticking);
    clearTimeout(this.timer);
    this.asking?.abort();
    const { socket } = this;
    this.socket = undefined;
    socket?.close();
  }

  private send(message: MessageInitShape<typeof WearerUpstreamSchema>): boolean {
    if (!this.live || this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(toBinary(WearerUpstreamSchema, create(WearerUpstreamSchema, message)));
    return true;
  }

  private connect(): void {
    this.timer = undefined;
    this.asking?.abort();
    this.asking = undefined;
    const { answers } = this.options;
    if (answers && this.failures >= FAILURES_BEFORE_ASKING) void this.ask(answers);
    else this.open();
  }

  private async ask(answers: (signal: AbortSignal) => Promise<unknown>): Promise<void> {
    const asking = new AbortController();
    this.asking = asking;
    const timer = setTimeout(() => asking.abort(), CONNECT_MS);
    const answered = await answers(asking.signal).then(
      () => true,
      () => false,
    );
    clearTimeout(timer);
    if (this.asking !== asking || this.stopped) return;
    this.asking = undefined;
    if (answered) this.open();
    else this.lost('no answer from the server');
  }

  private open(): void {
    const { makeSocket, url } = this.options;
    const socket = makeSocket ? makeSocket(url) : new WebSocket(url);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.heardMs = this.options.nowMs();
    const ours = (act: () => void) => () => {
      if (this.socket === socket) act();
    };
    socket.onopen = ours(() => this.hello(socket));
    socket.onclose = ours(() => this.lost('the link to the server broke'));
    socket.onmessage = (event: MessageEvent<ArrayBuffer>) => {
      if (this.socket === socket) this.receive(event.data);
    };
  }

  private hello(socket: WebSocket): void {
    const { token, phoneId, cameraLabel } = this.options;
    const value = { token: token(), phoneId, cameraLabel: cameraLabel().slice(0, 60) };
    const hello = create(WearerUpstreamSchema, { message: { case: 'hello', value } });
    socket.send(toBinary(WearerUpstreamSchema, hello));
  }

  private receive(data: ArrayBuffer): void {
    this.heardMs = this.options.nowMs();
    let down: WearerDownstream;
    try {
      down = fromBinary(WearerDownstreamSchema, new Uint8Array(data));
    } catch {
      return this.lost('the server says what this page does not understand');
    }
    const { message } = down;
    switch (message.case) {
      case 'welcome':
        this.state = { kind: 'live' };
        this.problem = '';
        this.failures = 0;
        this.backoff.reset();
        this.echo = { serverNs: 0n, arrivedMs: 0 };
        this.options.events.welcome(message.value);
        this.ping();
        break;
      case 'refused':
        if (message.value.final) this.refuse(message.value.reason);
        else this.lost(message.value.reason);
        break;
      case 'keyFrameWanted':
        this.options.events.keyFrameWanted();
        break;
      case 'tracked':
        this.problem = ''; // they are of use again
        this.options.events.tracked(message.value, this.heardMs);
        break;
      case 'pong':
        this.echo = { serverNs: message.value.serverNs, arrivedMs: this.heardMs };
        break;
      case 'problem':
        this.problem = message.value.text;
        break;
      case undefined:
        break;
    }
  }

  private ping(): void {
    const { serverNs, arrivedMs } = this.echo;
    const value = {
      sentNs: ns(this.options.nowMs()),
      echoServerNs: serverNs,
      echoArrivedNs: ns(arrivedMs),
    };
    this.send({ message: { case: 'ping', value } });
  }

  private tick(): void {
    if (this.socket) {
      const silentMs = this.options.nowMs() - this.heardMs;
      if (silentMs > (this.live ? SILENCE_MS : CONNECT_MS)) this.lost('no answer from the server');
    }
    this.ping();
  }

  private refuse(reason: string): void {
    this.stop();
    this.state = { kind: 'refused', reason };
  }

  private lost(reason: string): void {
    const { socket, state } = this;
    this.socket = undefined; // of a dead network, its close takes minutes: nobody waits for it
    socket?.close();
    ++this.failures;
    const sinceMs = state.kind === 'reconnecting' ? state.sinceMs : this.options.nowMs();
    this.state = { kind: 'reconnecting', reason, sinceMs };
    this.timer = setTimeout(() => this.connect(), this.backoff.nextMs());
  }
}
