import { plainWords } from '../transport/errors';
import type { Session } from './session';
import type { Participant } from './types';

/** What the server records, as it was last told. */
export interface Recording {
  readonly on: boolean;
  readonly file: string; // written now, or last
  readonly sinceMs: number; // since 1970
  readonly bytes: number;
  readonly problem: string; // why it stopped by itself
}

/** The recorder is one who is there; nobody else has this for an id. */
export const isRecorder = ({ participantId }: Pick<Participant, 'participantId'>): boolean =>
  participantId === 'recording';

const LOOK_MS = 5000; // how it goes, while it goes
const TIMEOUT = { timeoutMs: 15_000 };

/** Whether this session is recorded: asked when the recorder comes or goes, and at times while it is there. */
export class RecordingWatch {
  state: Recording | undefined;
  failure = '';
  private asking = false;
  private askedMs = -Infinity;
  private seen = false;
  private sessionId = '';

  constructor(private readonly session: Session) {}

  get on(): boolean {
    return this.state?.on ?? false;
  }

  /** Looks, where it is time to. */
  update(nowMs: number): void {
    const { session } = this;
    if (!session.live || this.asking) return;
    const seen = session.participants.some(isRecorder);
    const anew = seen !== this.seen || session.sessionId !== this.sessionId;
    if (!anew && !(this.on && nowMs - this.askedMs > LOOK_MS)) return;
    this.seen = seen;
    this.sessionId = session.sessionId;
    this.askedMs = nowMs;
    void this.ask(() => this.session.clients.recording.getRecording({}, TIMEOUT), false);
  }

  async toggle(): Promise<void> {
    const { recording } = this.session.clients;
    if (this.asking) return;
    await this.ask(
      () =>
        this.on ? recording.stopRecording({}, TIMEOUT) : recording.startRecording({}, TIMEOUT),
      true,
    );
  }

  private async ask(
    call: () => Promise<{ recording?: WireRecording }>,
    said: boolean,
  ): Promise<void> {
    this.asking = true;
    try {
      const { recording } = await call();
      this.failure = '';
      this.state = recording && {
        ...{ on: recording.on, file: recording.file, problem: recording.problem },
        ...{ sinceMs: Number(recording.sinceUnixNs / 1_000_000n), bytes: Number(recording.bytes) },
      };
    } catch (error) {
      if (said) this.failure = plainWords(error);
    } finally {
      this.asking = false;
    }
  }
}

interface WireRecording {
  readonly on: boolean;
  readonly file: string;
  readonly sinceUnixNs: bigint;
  readonly bytes: bigint;
  readonly problem: string;
}
