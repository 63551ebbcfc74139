import { create, fromBinary, type MessageInitShape, toBinary } from '@bufbuild/protobuf';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import {
  WearerCodec,
  WearerDownstreamSchema,
  type WearerUpstream,
  WearerUpstreamSchema,
} from '../../src/gen/saccade/v1/wearer_pb';
import { Uplink, type UplinkOptions } from '../../src/uplink/socket';

const SIZE = { width: 640, height: 480 };

/** The browser's end of a socket, and what the page sent through it. */
class FakeSocket {
  static readonly all: FakeSocket[] = [];
  readyState = 1;
  bufferedAmount = 0;
  binaryType = '';
  closed = false;
  onopen: (() => void) | undefined;
  onclose: (() => void) | undefined;
  onmessage: ((event: { data: ArrayBuffer }) => void) | undefined;
  readonly sent: WearerUpstream[] = [];

  constructor(readonly url: string) {
    FakeSocket.all.push(this);
  }
  send(bytes: Uint8Array): void {
    this.sent.push(fromBinary(WearerUpstreamSchema, bytes));
  }
  close(): void {
    this.closed = true;
  }
  say(message: MessageInitShape<typeof WearerDownstreamSchema>): void {
    const bytes = toBinary(WearerDownstreamSchema, create(WearerDownstreamSchema, message));
    this.onmessage?.({ data: bytes.slice().buffer });
  }
}

describe('Uplink', () => {
  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal('WebSocket', { OPEN: 1 });
    FakeSocket.all.length = 0;
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  const open = (more: Partial<UplinkOptions> = {}) => {
    const events = { welcome: vi.fn(), tracked: vi.fn(), keyFrameWanted: vi.fn() };
    const uplink = new Uplink({
      url: 'wss://server/wear/upstream',
      token: () => 'p1.secret',
      phoneId: 'phone',
      cameraLabel: () => 'back camera',
      events,
      nowMs: () => Date.now(),
      makeSocket: (url) => new FakeSocket(url) as unknown as WebSocket,
      random: () => 0,
      ...more,
    });
    return { uplink, events };
  };
  const newest = (): FakeSocket => {
    const socket = FakeSocket.all.at(-1);
    if (!socket) throw new Error('none');
    return socket;
  };
  const letIn = (socket = newest()): void => {
    socket.onopen?.();
    socket.say({ message: { case: 'welcome', value: { ...SIZE, fpsHz: 30 } } });
  };
  const coded = {
    timestamp: 1,
    keyFrame: true,
    codec: WearerCodec.H264,
    size: SIZE,
    data: new Uint8Array([1, 2, 3]),
  };

  it('says who it is first, in the message and not in the address', () => {
    const { uplink } = open();
    const socket = newest();
    expect(socket.url).not.toMatch(/secret/);
    expect(uplink.sendPicture(1, 1000, coded, 0)).toBe(false);
    letIn();
    expect(socket.sent[0]?.message.value).toMatchObject({ token: 'p1.secret', phoneId: 'phone' });
    expect(uplink.live).toBe(true);
    expect(uplink.sendPicture(7, 1234.5, coded, 90)).toBe(true);
    const picture = socket.sent.at(-1)?.message.value;
    expect(picture).toMatchObject({ pictureId: 7n, captureNs: 1_234_500_000n, clockwiseDeg: 90 });
    uplink.stop();
  });

  it('comes back after growing pauses of at most a second, and at once when told to', () => {
    const { uplink } = open();
    letIn();
    const pauses = [250, 500, 1000, 1000];
    for (const pause of pauses) {
      const count = FakeSocket.all.length;
      newest().onclose?.();
      expect(uplink.state.kind).toBe('reconnecting');
      vi.advanceTimersByTime(pause - 1);
      expect(FakeSocket.all).toHaveLength(count);
      vi.advanceTimersByTime(1);
      expect(FakeSocket.all).toHaveLength(count + 1);
    }
    newest().onclose?.();
    const count = FakeSocket.all.length;
    uplink.hurry();
    expect(FakeSocket.all).toHaveLength(count + 1);
    letIn();
    expect(uplink.live).toBe(true);
    uplink.stop();
  });

  it('spends no WebSocket on a server that answers nothing, and comes back as soon as it does', async () => {
    let answer = false;
    const answers = vi.fn((signal: AbortSignal) =>
      answer
        ? Promise.resolve()
        : new Promise((_, reject) => signal.addEventListener('abort', () => reject(new Error()))),
    );
    const { uplink } = open({ answers });
    letIn();
    newest().onclose?.();
    await vi.advanceTimersByTimeAsync(250);
    newest().onclose?.();
    const count = FakeSocket.all.length;
    await vi.advanceTimersByTimeAsync(60_000);
    expect(FakeSocket.all).toHaveLength(count);
    expect(answers.mock.calls.length).toBeGreaterThan(10);
    expect(uplink.state).toMatchObject({
      kind: 'reconnecting',
      reason: 'no answer from the server',
    });
    answer = true;
    uplink.hurry();
    await vi.advanceTimersByTimeAsync(0);
    expect(FakeSocket.all).toHaveLength(count + 1);
    letIn();
    expect(uplink.live).toBe(true);
    uplink.stop();
  });

  it('asks no more once it is stopped', async () => {
    const answers = vi.fn(() => Promise.reject(new Error()));
    const { uplink } = open({ answers });
    newest().onclose?.();
    await vi.advanceTimersByTimeAsync(250);
    newest().onclose?.();
    uplink.stop();
    const count = answers.mock.calls.length;
    await vi.advanceTimersByTimeAsync(10_000);
    expect(answers.mock.calls).toHaveLength(count);
  });

  it('gives up a link that is silent, and does not wait for its close', () => {
    const { uplink } = open();
    letIn();
    const dead = newest();
    vi.advanceTimersByTime(5400);
    expect(uplink.live).toBe(false);
    expect(dead.closed).toBe(true);
    expect(newest()).not.toBe(dead);
    letIn();
    dead.onclose?.(); // minutes later: it is not ours any more
    expect(uplink.live).toBe(true);
    uplink.stop();
  });

  it('stays out once it is refused for good, and tries again where it is not', () => {
    const { uplink } = open();
    newest().onopen?.();
    newest().say({
      message: { case: 'refused', value: { reason: 'another phone', final: false } },
    });
    expect(uplink.state).toMatchObject({ kind: 'reconnecting', reason: 'another phone' });
    vi.advanceTimersByTime(1000);
    newest().say({ message: { case: 'refused', value: { reason: 'revoked', final: true } } });
    expect(uplink.state).toEqual({ kind: 'refused', reason: 'revoked' });
    const count = FakeSocket.all.length;
    vi.advanceTimersByTime(60_000);
    expect(FakeSocket.all).toHaveLength(count);
  });

  it('echoes the pong, so that the server can set its clock', () => {
    const { uplink } = open();
    letIn();
    newest().say({ message: { case: 'pong', value: { echoSentNs: 1n, serverNs: 4711n } } });
    vi.advanceTimersByTime(1000);
    const ping = newest().sent.at(-1)?.message;
    expect(ping?.case).toBe('ping');
    expect(ping?.value).toMatchObject({ echoServerNs: 4711n });
    uplink.stop();
  });

  it('hears of tracked pictures and of wanted key frames', () => {
    const { uplink, events } = open();
    letIn();
    newest().say({ message: { case: 'tracked', value: { pictureId: 9n } } });
    newest().say({ message: { case: 'keyFrameWanted', value: {} } });
    newest().say({ message: { case: 'problem', value: { text: 'pictures of 3x2 came' } } });
    expect(events.tracked).toHaveBeenCalledOnce();
    expect(events.keyFrameWanted).toHaveBeenCalledOnce();
    expect(uplink.problem).toMatch(/3x2/);
    newest().say({ message: { case: 'tracked', value: { pictureId: 10n } } });
    expect(uplink.problem).toBe('');
    uplink.stop();
  });
});
