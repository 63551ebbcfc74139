import type { StoredMapFacts } from '../gen/saccade/v1/map_pb';
import { plainWords } from '../transport/errors';
import { EditError } from './edits';
import type { Session } from './session';

/** A map on the server's disk. */
export interface KeptMap {
  readonly id: string;
  readonly name: string; // empty: kept by the server itself
  readonly savedMs: number; // since 1970
  readonly metric: boolean;
  readonly landmarks: number;
  readonly bytes: number;
}

const TIMEOUT = { timeoutMs: 15_000 };

const toKept = (facts: StoredMapFacts): KeptMap => ({
  ...{ id: facts.mapId, name: facts.name, savedMs: 1000 * Number(facts.savedUnixS) },
  ...{ metric: facts.metric, landmarks: facts.landmarkCount, bytes: Number(facts.bytes) },
});

/** Maps that outlive the server's run. What fails throws an EditError, in words. */
export class Maps {
  constructor(private readonly session: Pick<Session, 'clients'>) {}

  /** Newest first. */
  async list(): Promise<readonly KeptMap[]> {
    const { map } = this.session.clients;
    return (await inWords(map.list({}, TIMEOUT))).maps.map(toKept);
  }

  /** Keeps a copy of the map as it is now. */
  async save(name: string): Promise<void> {
    await inWords(this.session.clients.map.save({ name }, TIMEOUT));
  }

  /** The map of now is kept and set aside; this one is looked for in the pictures that come. */
  async load(mapId: string): Promise<void> {
    await inWords(this.session.clients.map.load({ mapId }, TIMEOUT));
  }

  async remove(mapId: string): Promise<void> {
    await inWords(this.session.clients.map.delete({ mapId }, TIMEOUT));
  }
}

async function inWords<T>(call: Promise<T>): Promise<T> {
  try {
    return await call;
  } catch (error) {
    throw new EditError(plainWords(error));
  }
}
