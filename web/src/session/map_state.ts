import type { MapDelta } from '../gen/saccade/v1/map_pb';
import type { Pixel } from '../geometry/vec3';
import { toFeature } from './convert';
import { FrameRing } from './ring';
import type { Feature, FeatureState } from './types';

/** A feature as one frame saw it. */
export interface SeenFeature {
  readonly id: number;
  readonly state: FeatureState;
  readonly pixel: Pixel | undefined;
}

/** The server's map as told so far, and what recent frames saw of it. */
export class MapState {
  readonly features = new Map<number, Feature>();
  generation = -1;
  revision = 0;
  /** Rises with every change. */
  version = 0;
  private readonly seen = new FrameRing<readonly SeenFeature[]>(120);

  apply(delta: MapDelta): void {
    const generation = Number(delta.mapGeneration);
    if (delta.full || generation !== this.generation) {
      this.features.clear();
      this.seen.clear();
    }
    this.generation = generation;
    this.revision = Number(delta.mapRevision);
    for (const pb of delta.upserted) this.features.set(Number(pb.id), toFeature(pb));
    for (const id of delta.removedIds) this.features.delete(Number(id));
    this.seen.set(
      Number(delta.frameId),
      [...this.features.values()].map(({ id, state, pixel }) => ({ id, state, pixel })),
    );
    ++this.version;
  }

  /** What exactly that frame saw; undefined if no delta came for it. */
  seenIn(frameId: number): readonly SeenFeature[] | undefined {
    return this.seen.get(frameId);
  }

  /** States as of the newest delta that is no later than the frame. */
  seenUpTo(frameId: number): readonly SeenFeature[] | undefined {
    return this.seen.atOrBefore(frameId);
  }
}
