import type { AccessUnit } from '../gen/saccade/v1/video_pb';
import type { FrameFacts } from './types';

/** Where coded pictures go. */
export interface PictureSink {
  decode(facts: FrameFacts, unit: AccessUnit): void;
  /** A new subscription begins: the next unit is a key frame. */
  reset(): void;
  /** True while so much waits to be decoded that no more should come. */
  readonly behind: boolean;
}
