import type { JoinResponse } from '../gen/saccade/v1/session_pb';
import type { Clients } from '../transport/clients';
import { isRefusal } from '../transport/errors';
import { pbRoles } from './convert';
import type { KeptSession } from './kept_session';
import type { Tabs } from './tabs';
import type { Role } from './types';

/** Joins under a name: goes on with the session that there was, where that can be, or begins one. */
export class Joining {
  name: string;
  private resumes: string; // the session to go on with; empty: none
  private maybeShared: boolean;
  private readonly role: Role;
  private readonly kept: KeptSession | undefined;
  private readonly tabs: Tabs | undefined;
  private readonly personKey: string;

  constructor(
    private readonly session: Clients['session'],
    options: {
      readonly role: Role;
      readonly name: string;
      readonly kept?: KeptSession;
      readonly tabs?: Tabs;
      readonly personKey?: string;
    },
  ) {
    ({ name: this.name, role: this.role, kept: this.kept, tabs: this.tabs } = options);
    this.personKey = options.personKey ?? '';
    this.resumes = this.kept?.recall(this.name) ?? '';
    this.maybeShared = this.resumes !== '' && this.kept?.maybeShared === true;
  }

  /** A name belongs to a session: the next one is new. */
  rename(name: string): void {
    this.name = name;
    this.forget();
  }

  /** The next session is a new one. */
  forget(): void {
    this.resumes = '';
    this.kept?.forget();
  }

  /** Once it is this tab's turn; `crowded` hears how many are before it while it is not. */
  async join(signal: AbortSignal, crowded: (tabs: number) => void): Promise<JoinResponse> {
    const { tabs } = this;
    const asked = tabs?.ask(signal, this.maybeShared);
    let joined = await this.ask(this.resumes, signal);
    await asked; // usually done while the server answered
    await tabs?.turn(signal, crowded);
    // A duplicated tab has the same storage: the other one had the session first.
    if (this.resumes !== '' && tabs?.uses(this.resumes)) joined = await this.ask('', signal);
    this.maybeShared = false;
    this.resumes = joined.sessionId;
    this.kept?.keep(joined.sessionId, this.name);
    tabs?.use(joined.sessionId);
    return joined;
  }

  private async ask(resumeSessionId: string, signal: AbortSignal): Promise<JoinResponse> {
    const { name: displayName, personKey } = this;
    const request = { displayName, personKey, role: pbRoles[this.role] };
    const options = { signal, timeoutMs: 5000 };
    try {
      return await this.session.join({ ...request, resumeSessionId }, options);
    } catch (error) {
      if (resumeSessionId === '' || !isRefusal(error)) throw error;
      return this.session.join(request, options); // what was kept is of no use here
    }
  }
}
