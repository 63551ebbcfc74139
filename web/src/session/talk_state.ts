import type { Client } from '@connectrpc/connect';
import type { Event } from '../gen/saccade/v1/session_pb';
import { Topic } from '../gen/saccade/v1/session_pb';
import type { ChatMessage as PbMessage, TalkService, VoiceEvent } from '../gen/saccade/v1/talk_pb';

/** One line of the conversation. */
export interface ChatMessage {
  readonly number: number; // rises while the server runs
  readonly participantId: string;
  readonly name: string;
  readonly text: string;
  readonly annotationId: string; // a mark to look at; empty: none
  readonly sentMs: number; // since 1970
}

/** The wearer's large pause: nobody is shown a picture. */
export interface PicturePause {
  readonly by: string;
  readonly sinceMs: number; // since 1970
}

const KEPT = 500;
const EVERY_TOPIC = Object.values(Topic).filter(
  (topic): topic is Topic =>
    typeof topic === 'number' && topic !== Topic.UNSPECIFIED && topic !== Topic.VOICE,
);

/** What is said, and whether there are pictures; one session's. Knows no DOM. */
export class TalkState {
  /** Oldest first. */
  messages: readonly ChatMessage[] = [];
  /** Undefined: pictures are shown. Over a lost connection as it was last told. */
  pause: PicturePause | undefined;
  /** True while voices are asked for. */
  listens = false;
  /** Rises with every change of the above. */
  version = 0;
  /** Hears of voices as they come. */
  onVoice: ((event: VoiceEvent) => void) | undefined;
  /** Hears of each message that was said while this page was there, once. */
  onMessage: ((message: ChatMessage) => void) | undefined;
  private began = false; // what was said before is known

  /** What to subscribe to: `usual` (empty: all), and voices if they are asked for. */
  topics(usual: readonly Topic[]): Topic[] {
    if (!this.listens) return [...usual];
    return [...(usual.length === 0 ? EVERY_TOPIC : usual), Topic.VOICE];
  }

  receive(event: Event['event']): void {
    switch (event.case) {
      case 'chat':
        this.said(event.value.messages.map(toMessage));
        break;
      case 'voice':
        this.onVoice?.(event.value);
        break;
      case 'picturePause': {
        const { paused, by, sinceUnixNs } = event.value;
        this.pause = paused ? { by, sinceMs: Number(sinceUnixNs / 1_000_000n) } : undefined;
        ++this.version;
        break;
      }
      default:
        break;
    }
  }

  /** Asks for what was said before, once a subscription is open. */
  async catchUp(
    talk: Pick<Client<typeof TalkService>, 'listMessages'>,
    sessionId: string,
    signal: AbortSignal,
  ): Promise<void> {
    const listed = talk.listMessages({ sessionId }, { signal, timeoutMs: 5000 });
    const kept = await listed.catch(() => undefined); // what breaks it breaks the stream as well
    if (kept && !signal.aborted) this.history(kept.messages);
  }

  /** All that the server keeps. */
  history(kept: readonly PbMessage[]): void {
    const messages = kept.map(toMessage);
    const last = this.messages.at(-1)?.number ?? 0;
    // Numbers that fell: another server, whose conversation is another one.
    if ((messages.at(-1)?.number ?? 0) < last) this.messages = [];
    if (this.began) this.said(messages);
    else this.add(messages);
    this.began = true;
  }

  private said(messages: readonly ChatMessage[]): void {
    for (const message of this.add(messages)) this.onMessage?.(message);
  }

  /** Adds those that are not there yet, in their order; returns them. */
  private add(messages: readonly ChatMessage[]): ChatMessage[] {
    const known = new Set(this.messages.map(({ number }) => number));
    const fresh = messages.filter(({ number }) => !known.has(number));
    if (fresh.length === 0) return fresh;
    const all = [...this.messages, ...fresh].sort((a, b) => a.number - b.number);
    this.messages = all.slice(-KEPT);
    ++this.version;
    return fresh;
  }
}

const toMessage = (message: PbMessage): ChatMessage => ({
  number: Number(message.number),
  participantId: message.participantId,
  name: message.displayName,
  text: message.text,
  annotationId: message.annotationId,
  sentMs: Number(message.sentUnixNs / 1_000_000n),
});
