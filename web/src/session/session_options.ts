import type { Topic } from '../gen/saccade/v1/session_pb';
import type { KeptSession } from './kept_session';
import type { Tabs } from './tabs';
import type { Role, View } from './types';

export interface SessionOptions {
  readonly role: Role;
  readonly view: View;
  readonly name: string;
  readonly topics?: Topic[]; // absent: all
  /** Where the session is kept for a reload; without it, only while the page lives. */
  readonly kept?: KeptSession;
  /** The secret of whoever sits here; absent: a person of this session alone. */
  readonly personKey?: string;
  /** The other tabs of this browser, where they can be asked. */
  readonly tabs?: Tabs;
  /** Before joining: redeems an invite, and waits to be let in. Rejects if nobody lets one in. */
  readonly enter?: (signal: AbortSignal, name: string, waiting: () => void) => Promise<void>;
}
