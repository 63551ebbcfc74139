import type { VoiceEvent } from '../gen/saccade/v1/talk_pb';
import { pageNowMs } from '../session/clock';
import type { Session } from '../session/session';
import { FRAME_MS, loudness, SAMPLE_RATE_HZ } from './frames';
import { Microphone, microphoneWords, whyNoVoice } from './microphone';
import type { Heard } from './play_worklet';
import { VoiceCoder } from './voice_coder';
import { VoicePlayer } from './voice_player';
import { VoiceSender } from './voice_sender';

const HEARD_LEVEL = 0.008;
const SPEAKS_MS = 350; // a name stays lit between words
const SENT_LEVEL = 0.003; // quieter is silence, which need not be sent
const HANGOVER_MS = 500;

export type VoiceState = 'off' | 'opening' | 'on';

/**
 * The voices of a session: this page's own, once it has joined and its microphone is open, and
 * everybody else's. Nothing is heard and no microphone is open before somebody asks for it.
 */
export class VoiceRoom {
  state: VoiceState = 'off';
  /** Why this page is not heard, or hears nothing, with the remedy. */
  problem = '';
  muted = false;
  /** Heard only while a key or the button is held. */
  pushToTalk = false;
  /** Rises with every change that is shown. */
  version = 0;
  /** Of each speaker, what became of their packets; for whoever measures. */
  readonly heard = new Map<string, Heard>();
  private pressed = false;
  private readonly spokeMs = new Map<string, number>();
  private context: AudioContext | undefined;
  private player: VoicePlayer | undefined;
  private microphone: Microphone | undefined;
  private coder: VoiceCoder | undefined;
  private readonly sender: VoiceSender;
  private sequence = 0;
  private readonly captured = new Map<number, number>(); // [ms] by sequence, while it is coded
  private loudMs = -Infinity;

  constructor(private readonly session: Session) {
    this.sender = new VoiceSender((packets) =>
      session.clients.talk.speak({ sessionId: session.sessionId, packets }, { timeoutMs: 2000 }),
    );
    session.talk.onVoice = (event) => this.receive(event);
  }

  /** True while what is said here goes out. */
  get open(): boolean {
    if (this.state !== 'on' || !this.microphone || this.muted) return false;
    return !this.pushToTalk || this.pressed;
  }

  get hasMicrophone(): boolean {
    return this.microphone !== undefined;
  }

  /** Lit: somebody is heard, or this page is. */
  speaks(participantId: string): boolean {
    return performance.now() - (this.spokeMs.get(participantId) ?? -Infinity) < SPEAKS_MS;
  }

  /** By a tap or a key: browsers play sound and give a microphone only then. */
  async join(): Promise<void> {
    if (this.state !== 'off') return;
    this.change('opening');
    const context = new AudioContext({ sampleRate: SAMPLE_RATE_HZ, latencyHint: 'interactive' });
    this.context = context;
    try {
      void context.resume();
      this.player = await VoicePlayer.open(context, (heard) => this.onHeard(heard));
    } catch (error) {
      this.leave();
      this.fail(`No sound: ${error instanceof Error ? error.message : String(error)}`);
      return;
    }
    if (this.context !== context) return; // left meanwhile
    this.session.listen(true);
    this.change('on');
    await this.openMicrophone(context);
  }

  private async openMicrophone(context: AudioContext): Promise<void> {
    const whyNot = whyNoVoice();
    if (whyNot) {
      this.fail(whyNot);
      return;
    }
    try {
      const microphone = await Microphone.open(context, (samples, capturedMs) =>
        this.onFrame(samples, capturedMs),
      );
      if (this.context !== context) {
        microphone.close();
        return;
      }
      this.coder = new VoiceCoder(
        ({ sequence, opus }) => this.onCoded(sequence, opus),
        (problem) => this.fail(problem),
      );
      // Above what this page, loaded anew, has sent before.
      this.sequence = Math.max(this.sequence, Math.floor(pageNowMs() / FRAME_MS));
      this.microphone = microphone;
      this.fail('');
    } catch (error) {
      this.fail(microphoneWords(error));
    }
  }

  leave(): void {
    this.session.listen(false);
    this.microphone?.close();
    this.coder?.close();
    this.player?.close();
    void this.context?.close();
    this.microphone = this.coder = this.player = this.context = undefined;
    this.sender.clear();
    this.heard.clear();
    this.problem = '';
    this.change('off');
  }

  toggleMute(): void {
    this.muted = !this.muted;
    ++this.version;
  }

  togglePushToTalk(): void {
    this.pushToTalk = !this.pushToTalk;
    ++this.version;
  }

  /** The key or the button of push to talk. */
  press(pressed: boolean): void {
    if (this.pressed === pressed) return;
    this.pressed = pressed;
    ++this.version;
  }

  /** What became of everybody's packets, in words, for whoever measures. */
  get figures(): string {
    return [...this.heard.values()]
      .map(({ counts: { played, concealed, late, skipped }, delayMs }) =>
        [played, concealed, late, skipped, delayMs.toFixed(0)].join(' '),
      )
      .join(', ');
  }

  private change(state: VoiceState): void {
    this.state = state;
    ++this.version;
  }

  private fail(problem: string): void {
    this.problem = problem;
    ++this.version;
  }

  private onFrame(samples: Float32Array<ArrayBuffer>, capturedMs: number): void {
    const sequence = ++this.sequence; // silence counts: others know by it how long it was
    if (!this.open) return;
    if (loudness(samples) > SENT_LEVEL) this.loudMs = capturedMs;
    if (capturedMs - this.loudMs > HANGOVER_MS) return;
    if (capturedMs - this.loudMs < SPEAKS_MS) {
      this.spokeMs.set(this.session.participantId, performance.now());
    }
    this.captured.set(sequence, capturedMs);
    if (this.captured.size > 50) this.captured.delete(Math.min(...this.captured.keys()));
    this.coder?.code(sequence, samples);
  }

  private onCoded(sequence: number, opus: Uint8Array<ArrayBuffer>): void {
    const capturedMs = this.captured.get(sequence) ?? pageNowMs();
    this.captured.delete(sequence);
    if (!this.session.live) return;
    const serverMs = capturedMs + (this.session.clock.offsetMs ?? 0);
    const captureNs = BigInt(Math.round(serverMs * 1000)) * 1000n;
    this.sender.push({ sequence: BigInt(sequence), captureNs, opus });
    const problem = this.sender.failing ? 'Your voice does not get through to the server.' : '';
    if (problem !== this.problem) this.fail(problem);
  }

  private receive({ participantId, packets }: VoiceEvent): void {
    const { player } = this;
    if (!player) return;
    const arrivedMs = performance.now();
    const loss = Number(document.documentElement.dataset['voiceLoss'] ?? 0); // a test's bad network
    for (const { sequence, opus } of packets) {
      if (loss > 0 && Math.random() < loss) continue;
      player.play({ speaker: participantId, sequence: Number(sequence), opus, arrivedMs });
    }
  }

  private onHeard(heard: Heard): void {
    this.heard.set(heard.speaker, heard);
    if (heard.level > HEARD_LEVEL) this.spokeMs.set(heard.speaker, performance.now());
  }
}
