import type { GazeState } from '../gen/saccade/v1/gaze_pb';
import { plainWords } from '../transport/errors';
import type { LeaseKeeper, LeaseKeeping } from '../transport/lease_keeper';
import type { LeaseTold } from '../transport/lease_loop';
import { type GazeTarget, ownHandover } from './gaze';
import { fromTarget, toGaze } from './gaze_convert';
import type { Session } from './session';

/** What this page has of the right to turn the head. */
export type Lease =
  | { readonly kind: 'none' }
  | { readonly kind: 'waiting'; readonly position: number; readonly pilot: string }
  | { readonly kind: 'held'; readonly id: string };

/** A request about the head that failed, in words. */
export class GazeError extends Error {}

type Command = 'stopFixating' | 'home' | 'keepHorizon' | 'explore';

const NONE: Lease = { kind: 'none' };
const TIMEOUT = { timeoutMs: 2000 };
const ANSWER_MS = 4000;

/**
 * Pilots the head by lease: asks, queues, keeps the lease for as long as this page lives, notices
 * when it is gone. No heartbeat leaves without a lease or a place in the queue.
 */
export class GazePilot {
  lease: Lease = NONE;
  /** Why the lease went, in words; empty once asked for anew. */
  lost = '';
  /** Rises with every change. */
  version = 0;
  private owner = ''; // the session whose lease it is
  private keeper: LeaseKeeper | undefined;
  private answered: (() => void) | undefined; // ends the waiting for a first answer

  constructor(
    private readonly session: Session,
    private readonly keeping: LeaseKeeping,
  ) {}

  get holds(): boolean {
    return this.lease.kind === 'held' && this.owner === this.session.sessionId;
  }

  /** Makes ready to pilot at once. */
  warm(): void {
    this.keeping.warm();
  }

  /** Asks for the lease; true if it is held now, false if others are before. */
  async acquire(): Promise<boolean> {
    if (this.holds) return true;
    if (this.lease.kind === 'waiting' && this.owner === this.session.sessionId) return false;
    void this.end('');
    const refused = await this.begin();
    if (refused) throw new GazeError(refused);
    return this.holds;
  }

  /** Gives the lease back, or leaves the queue. */
  async release(): Promise<void> {
    if (this.lease.kind === 'none') return;
    const sessionId = this.owner;
    await this.end(''); // a late request would queue us again
    await this.ask(() => this.session.clients.gaze.releaseLease({ sessionId }, TIMEOUT));
  }

  /** No more heartbeats: the page is being left. */
  leave(): void {
    void this.end('');
  }

  /** To be called now and then: a lease belongs to its session. */
  check(): void {
    const { clients, sessionId } = this.session;
    const { owner } = this;
    if (this.lease.kind === 'none' || owner === sessionId) return;
    void this.end('A new session has begun; the lease ended with the old one.');
    // After a new name the old session is still known: then the head need not wait for silence.
    clients.gaze.releaseLease({ sessionId: owner }, TIMEOUT).catch(() => undefined);
  }

  async fixate(target: GazeTarget, fast: boolean): Promise<void> {
    const { clients, sessionId } = this.session;
    await this.steer(() =>
      clients.gaze.fixate({ sessionId, target: fromTarget(target), fast }, TIMEOUT),
    );
  }

  home(): Promise<void> {
    return this.command('home');
  }

  keepHorizon(): Promise<void> {
    return this.command('keepHorizon');
  }

  explore(): Promise<void> {
    return this.command('explore');
  }

  /** Stops the head; where nobody pilots, with a lease for that moment. */
  async stop(): Promise<void> {
    const pilot = this.session.gaze?.pilot;
    if (this.holds) return this.command('stopFixating');
    if (pilot && pilot.participantId !== this.session.participantId) {
      throw new GazeError(`${pilot.name} pilots: only ${pilot.name} or the wearer can stop it.`);
    }
    const granted = await this.acquire();
    try {
      if (!granted) throw new GazeError('Somebody else has just taken the lease.');
      await this.command('stopFixating');
    } finally {
      await this.release();
    }
  }

  private async command(name: Command): Promise<void> {
    const { clients, sessionId } = this.session;
    await this.steer(() => clients.gaze[name]({ sessionId }, TIMEOUT));
  }

  private async steer(call: () => Promise<{ state?: GazeState }>): Promise<void> {
    const { state } = await this.ask(call);
    const { gaze } = this.session;
    // Usually ahead of the stream's.
    if (state && (!gaze || state.timeNs > gaze.timeNs)) this.session.gaze = toGaze(state);
    ++this.version;
  }

  private async ask<T>(call: () => Promise<T>): Promise<T> {
    try {
      return await call();
    } catch (error) {
      throw new GazeError(plainWords(error));
    }
  }

  /** Asks, and goes on asking; the first answer's refusal in words, or nothing. */
  private async begin(): Promise<string> {
    const { sessionId } = this.session;
    this.owner = sessionId;
    let refused = '';
    await new Promise<void>((resolve) => {
      const slow = setTimeout(() => {
        refused = 'the server did not answer in time';
        void this.end('');
      }, ANSWER_MS);
      this.answered = () => {
        clearTimeout(slow);
        resolve();
      };
      this.keeper = this.keeping.keep(sessionId, (told) => {
        if (this.answered && told.kind === 'refused') {
          refused = told.reason;
          void this.end('');
        } else {
          this.told(told);
        }
        this.answered?.();
        this.answered = undefined;
      });
    });
    return refused;
  }

  private told(told: LeaseTold): void {
    const { lease } = this;
    if (told.kind === 'refused') {
      void this.dropped(told.reason);
      return;
    }
    if (told.granted) {
      if (lease.kind === 'held' && lease.id === told.leaseId) return;
      this.lease = { kind: 'held', id: told.leaseId };
    } else {
      const { queuePosition: position, pilot } = told;
      if (lease.kind === 'waiting' && lease.position === position && lease.pilot === pilot) return;
      this.lease = { kind: 'waiting', position, pilot };
    }
    ++this.version;
  }

  /** The lease is somebody else's. Whom the wearer took it from is first in the queue, and stays. */
  private async dropped(reason: string): Promise<void> {
    const me = this.session.participantId;
    void this.end(`You pilot no longer: ${reason}.`);
    const { version } = this;
    let state: GazeState | undefined;
    try {
      state = (await this.session.clients.gaze.getState({}, TIMEOUT)).state;
    } catch {
      return; // the refusal's own words have to do
    }
    if (version !== this.version) return; // something else was asked for meanwhile
    if (state?.queue.some((one) => one.participantId === me)) {
      this.lost = '';
      await this.begin(); // in vain: then the reason is the one that ended it
    } else if (state?.lastHandover) {
      const why = ownHandover(state.lastHandover, this.session.displayName);
      this.lost = `You pilot no longer: ${why}.`;
    }
    ++this.version;
  }

  private async end(why: string): Promise<void> {
    const { keeper } = this;
    this.answered?.();
    this.answered = undefined;
    this.keeper = undefined;
    this.lease = NONE;
    this.lost = why;
    ++this.version;
    await keeper?.stop();
  }
}
