import { create } from '@bufbuild/protobuf';
import { describe, expect, it, vi } from 'vitest';
import { Topic } from '../../src/gen/saccade/v1/session_pb';
import {
  ChatEventSchema,
  ChatMessageSchema,
  type ChatMessage as PbMessage,
} from '../../src/gen/saccade/v1/talk_pb';
import { PicturePauseSchema } from '../../src/gen/saccade/v1/session_pb';
import { TalkState } from '../../src/session/talk_state';
import { FRAME } from '../../src/talk/frames';
import { JitterBuffer } from '../../src/talk/jitter_buffer';
import { type Packet, VoiceSender } from '../../src/talk/voice_sender';
import { messageWords } from '../../src/ui/news';
import { orderIn } from '../../src/ui/spoken_pause';
import { clockWords, pauseWords } from '../../src/ui/words';

const message = (number: number, text = `m${number}`): PbMessage =>
  create(ChatMessageSchema, { number: BigInt(number), text, displayName: 'Ann' });
const chat = (...messages: PbMessage[]) =>
  ({ case: 'chat', value: create(ChatEventSchema, { messages }) }) as const;
const numbers = (state: TalkState): number[] => state.messages.map(({ number }) => number);

describe('TalkState', () => {
  it('tells of what is said while it is there, once, and not of what was said before', () => {
    const state = new TalkState();
    const told: number[] = [];
    state.onMessage = ({ number }) => told.push(number);
    state.receive(chat(message(3))); // the stream may be ahead of the list
    state.history([message(1), message(2), message(3)]);
    state.receive(chat(message(4)));
    state.history([message(1), message(2), message(3), message(4), message(5)]); // reconnected
    expect(numbers(state)).toEqual([1, 2, 3, 4, 5]);
    expect(told).toEqual([3, 4, 5]);
  });

  it('forgets the conversation of a server that began anew', () => {
    const state = new TalkState();
    state.history([message(70), message(71)]);
    state.history([message(1, 'anew')]);
    expect(state.messages.map(({ text }) => text)).toEqual(['anew']);
  });

  it('keeps the last 500', () => {
    const state = new TalkState();
    state.history(Array.from({ length: 490 }, (_, i) => message(i + 1)));
    state.receive(chat(...Array.from({ length: 30 }, (_, i) => message(491 + i))));
    expect(state.messages.length).toBe(500);
    expect(state.messages[0]?.number).toBe(21);
  });

  it('knows that the picture is paused until it is told otherwise', () => {
    const state = new TalkState();
    const value = create(PicturePauseSchema, {
      paused: true,
      by: 'Ann',
      sinceUnixNs: 1_700_000_000_123_000_000n,
    });
    state.receive({ case: 'picturePause', value });
    expect(state.pause).toEqual({ by: 'Ann', sinceMs: 1_700_000_000_123 });
    expect(pauseWords(state.pause!)).toBe(
      `Ann paused the picture at ${clockWords(1_700_000_000_123)}; the map stays live`,
    );
    state.receive({ case: 'picturePause', value: create(PicturePauseSchema, { by: 'Ann' }) });
    expect(state.pause).toBeUndefined();
  });

  it('asks for voices by name only while it listens', () => {
    const state = new TalkState();
    expect(state.topics([])).toEqual([]);
    state.listens = true;
    const all = state.topics([]);
    expect(all).toContain(Topic.VOICE);
    expect(all).toContain(Topic.VIDEO);
    expect(all).toContain(Topic.POINTER);
    expect(all).not.toContain(Topic.UNSPECIFIED);
    expect(state.topics([Topic.POSE])).toEqual([Topic.POSE, Topic.VOICE]);
  });
});

/** A frame whose samples say which it is. */
const frame = (sequence: number): Float32Array => new Float32Array(FRAME).fill(sequence / 1000);

/** Pulls `count` frames of 20 ms and says what was heard in the middle of each: its number, 0 silence. */
function hear(buffer: JitterBuffer, count: number): number[] {
  const out = new Float32Array(FRAME);
  return Array.from({ length: count }, () => {
    for (let at = 0; at < FRAME; at += 120) buffer.pull(out.subarray(at, at + 120));
    return Math.round(1000 * (out[FRAME - 200] ?? 0));
  });
}

describe('JitterBuffer', () => {
  it('plays in order what came out of order, and waits no longer than is needed', () => {
    const buffer = new JitterBuffer();
    for (const sequence of [2, 1, 4, 3, 5]) buffer.push(sequence, frame(sequence), 20 * sequence);
    expect(hear(buffer, 5)).toEqual([1, 2, 3, 4, 5]);
    expect(buffer.statistics).toEqual({ played: 5, concealed: 0, late: 0, skipped: 0 });
  });

  it('conceals a lost frame by a fade and goes on in time', () => {
    const buffer = new JitterBuffer();
    for (const sequence of [1, 2, 4, 5]) buffer.push(sequence, frame(400), 20 * sequence);
    hear(buffer, 2);
    const out = new Float32Array(FRAME);
    buffer.pull(out);
    expect(out[0]).toBeCloseTo(0.4, 2);
    expect(out[FRAME / 2]).toBeGreaterThan(0.05);
    expect(Math.abs(out[FRAME - 1] ?? 1)).toBe(0);
    buffer.pull(out); // comes back without a click
    expect(out[0]).toBe(0);
    expect(out[FRAME / 2]).toBeCloseTo(0.4, 3);
    expect(buffer.statistics.concealed).toBe(1);
  });

  it('waits as long as the network is uneven', () => {
    const even = new JitterBuffer();
    const uneven = new JitterBuffer();
    for (let i = 0; i < 150; ++i) {
      even.push(i, frame(1), 20 * i);
      uneven.push(i, frame(1), 20 * i + (i % 10 === 0 ? 120 : 0));
      hear(even, 1);
      hear(uneven, 1);
    }
    expect(even.delayMs).toBeLessThan(40);
    expect(uneven.delayMs).toBeGreaterThan(100);
    expect(uneven.delayMs).toBeLessThanOrEqual(240);
  });

  it('ends with the speaker, and a silence that was not sent costs nothing', () => {
    const buffer = new JitterBuffer();
    for (let i = 1; i <= 5; ++i) buffer.push(i, frame(i), 20 * i);
    hear(buffer, 12);
    expect(buffer.active).toBe(false);
    for (let i = 600; i <= 605; ++i) buffer.push(i, frame(i), 20 * i);
    expect(hear(buffer, 6)).toEqual([600, 601, 602, 603, 604, 605]);
    expect(buffer.statistics.concealed).toBe(0);
  });

  it('catches up after a delay that is over', () => {
    const buffer = new JitterBuffer();
    for (let i = 1; i <= 3; ++i) buffer.push(i, frame(1), 20 * i);
    hear(buffer, 1);
    for (let i = 4; i <= 20; ++i) buffer.push(i, frame(1), 60 + i); // all at once
    for (let i = 21; i <= 221; ++i) {
      buffer.push(i, frame(1), 20 * i);
      hear(buffer, 1);
    }
    expect(buffer.statistics.skipped).toBeGreaterThan(5);
    expect(buffer.statistics.late).toBe(0);
  });

  it('hears a page that was loaded anew, whose numbers may be lower', () => {
    const buffer = new JitterBuffer();
    for (let i = 10_000; i < 10_010; ++i) buffer.push(i, frame(1), 20 * i);
    hear(buffer, 3);
    for (let i = 1; i < 4; ++i) buffer.push(i, frame(i), 200_000 + 20 * i);
    expect(hear(buffer, 3)).toEqual([1, 2, 3]);
  });

  it('is bounded whatever is sent', () => {
    const buffer = new JitterBuffer();
    for (let i = 0; i < 10_000; ++i) buffer.push(i, frame(1), 20 * i);
    let frames = 0;
    while (hear(buffer, 1)[0] !== 0 && frames < 200) ++frames;
    expect(frames).toBeLessThan(30);
  });
});

describe('VoiceSender', () => {
  const packet = (sequence: number): Packet => ({
    sequence: BigInt(sequence),
    captureNs: 0n,
    opus: new Uint8Array(1),
  });

  it('sends at once, in order, and batches while answers are slow', async () => {
    const sent: number[][] = [];
    const answers: (() => void)[] = [];
    const sender = new VoiceSender((packets) => {
      sent.push(packets.map(({ sequence }) => Number(sequence)));
      return new Promise<void>((resolve) => answers.push(resolve));
    });
    for (let i = 1; i <= 6; ++i) sender.push(packet(i));
    expect(sent).toEqual([[1], [2]]);
    answers[0]?.();
    await vi.waitFor(() => expect(sent).toEqual([[1], [2], [3, 4, 5, 6]]));
  });

  it('keeps the newest half second, and says when nothing gets through', async () => {
    let failing = false;
    const answers: (() => void)[] = [];
    const sender = new VoiceSender(() =>
      failing ? Promise.reject(new Error('gone')) : new Promise<void>((done) => answers.push(done)),
    );
    for (let i = 1; i <= 60; ++i) sender.push(packet(i));
    expect(sender.dropped).toBe(60 - 2 - 25);
    failing = true;
    answers.forEach((done) => done());
    for (let i = 0; i < 5; ++i) {
      await new Promise((resolve) => setTimeout(resolve, 0));
      sender.push(packet(100 + i));
    }
    expect(sender.failing).toBe(true);
  });
});

describe('words', () => {
  it('hears orders among other words, the last one wins', () => {
    expect(orderIn('okay, pause the picture please')).toBe('pause');
    expect(orderIn('Pause. No, go on!')).toBe('go on');
    expect(orderIn('hand me the spanner')).toBeUndefined();
  });

  it('says a message in one line, with its mark', () => {
    const said = {
      ...{ number: 1, participantId: 'p', name: 'Ann', sentMs: 0 },
      ...{ text: 'this one', annotationId: '' },
    };
    expect(messageWords(said, undefined)).toBe('Ann: this one');
    expect(messageWords({ ...said, text: '', annotationId: 'x' }, undefined)).toBe(
      'Ann: look at a mark that is gone',
    );
  });
});
