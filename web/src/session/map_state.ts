import type { MapDelta } from '../gen/saccade/v1/map_pb';
import { toFeature } from './convert';
import type { Feature } from './types';

/**
 * The server's map as told so far. Where a frame saw a feature is not here but in that frame's facts: a
 * delta names only what has changed, so the rest would be taken for seen where it was some time ago.
 */
export class MapState {
  readonly features = new Map<number, Feature>();
  generation = -1;
  revision = 0;
  /** Rises with every change. */
  version = 0;

  /** Of a state in parts only the first is `full`: the others add to it. */
  apply(delta: MapDelta): void {
    const generation = Number(delta.mapGeneration);
    if (delta.full || generation !== this.generation) this.features.clear();
    this.generation = generation;
    this.revision = Number(delta.mapRevision);
    for (const pb of delta.upserted) this.features.set(Number(pb.id), toFeature(pb));
    for (const id of delta.removedIds) this.features.delete(Number(id));
    ++this.version;
  }
}
