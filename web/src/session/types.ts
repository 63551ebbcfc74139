import type { Camera } from '../geometry/camera';
import type { Covariance3 } from '../geometry/covariance';
import type { Quaternion, Rigid3 } from '../geometry/rigid3';
import { distance, type Pixel, type Vec3 } from '../geometry/vec3';

export type TrackingStatus =
  | 'unknown'
  | 'initialising'
  | 'tracking'
  | 'coasting'
  | 'lost'
  | 'relocalising';
export type Quality = 'unknown' | 'bad' | 'poor' | 'good';
export type FeatureState = 'not_attempted' | 'measured' | 'failed';
export type AnchorState = 'provisional' | 'tracking' | 'paused' | 'stopped';
export type Shape =
  | 'cube'
  | 'note'
  | 'arrow'
  | 'ink'
  | 'box'
  | 'measure'
  | 'pin'
  | 'picture'
  | 'check_list';
export type Role = 'expert' | 'wearer' | 'viewer';
export type View = 'raw' | 'augmented';

/** The camera at one frame. Frame ids fit a number: 2^53 frames are nine million years. */
/** Where a marker that moves is: x right, y up, z towards who looks at it. */
export interface MarkerPose {
  readonly family: string;
  readonly id: number;
  readonly worldFromMarker: Rigid3;
}

export interface Pose {
  readonly frameId: number;
  readonly status: TrackingStatus;
  readonly quality: Quality;
  readonly advice: string;
  readonly metric: boolean;
  readonly worldFromCamera: Rigid3;
  readonly attempted: number;
  readonly matched: number;
  readonly mapRevision: number;
  readonly markers: readonly MarkerPose[]; // that things of the scene are fixed to
}

/** True where the pose is an estimate of this frame's own, not the last one before tracking was lost. */
export const isPlaced = (pose: Pose | undefined): pose is Pose =>
  pose?.status === 'tracking' || pose?.status === 'coasting';

/** Server's monotonic clock [ms]; 0: stage not run. */
export interface Stages {
  readonly captured: number;
  readonly received: number;
  readonly tracked: number;
  readonly encoded: number;
  readonly queued: number;
}

/** A feature as one frame saw it: where it measured it, or where it expected it and found nothing. */
export interface SeenFeature {
  readonly state: 'measured' | 'failed';
  readonly pixel: Pixel;
}

/** By feature id, of that very frame; what is not in it was not searched for. */
export type FrameFeatures = ReadonlyMap<number, SeenFeature>;

/** What is known of a frame before its picture is decoded: everything but the picture. */
export interface FrameFacts {
  readonly frameId: number;
  readonly view: View;
  readonly pose: Pose | undefined;
  readonly camera: Camera;
  /** Undefined: the server did not say. */
  readonly features?: FrameFeatures | undefined;
  readonly stages: Stages;
  readonly arrivedMs: number; // this page's clock, performance.timeOrigin + now()
}

export interface Feature {
  readonly id: number;
  readonly state: FeatureState;
  readonly pointInWorld: Vec3;
  readonly covariance: Covariance3 | undefined;
  readonly depthKnown: boolean;
  readonly pixel: Pixel | undefined;
  readonly matchedCount: number;
}

export interface Anchor {
  readonly state: AnchorState;
  readonly pointInWorld: Vec3 | undefined; // undefined: its place in this map is not known
  readonly covariance: Covariance3 | undefined;
  readonly errorMm: number;
  readonly errorPx: number | undefined;
  readonly reason: string;
}

export interface Annotation {
  readonly id: string;
  readonly shape: Shape;
  readonly text: string;
  readonly author: string;
  readonly sizeM: number;
  readonly colorRgba: number;
  readonly createdMs: number;
  readonly anchor: Anchor;
  /** INK: its stroke; MEASURE: its other end; from the anchor, axes parallel to world. */
  readonly inkOffsetsM: readonly Vec3[];
  readonly authorPersonId: string; // empty: made before persons were known
  readonly locked: boolean;
  readonly worldFromMark: Quaternion | undefined; // undefined: axes parallel to world
  readonly extentM: Vec3 | undefined;
  readonly number: number; // of a pin; 0: none
  readonly lengthM: number;
  readonly lengthSigmaM: number;
  readonly picture: PictureFacts | undefined;
  readonly checkItems: readonly CheckItem[];
}

/** Of a picture pinned to a place; its bytes come by themselves. */
export interface PictureFacts {
  readonly sha256: string;
  readonly width: number; // [px]
  readonly height: number;
}

export interface CheckItem {
  readonly text: string;
  readonly done: boolean;
  readonly doneBy: string; // a name; empty: nobody
}

/** What of a mark is its form, beside where it is. */
export type MarkForm = Pick<
  Annotation,
  | 'shape'
  | 'text'
  | 'sizeM'
  | 'colorRgba'
  | 'inkOffsetsM'
  | 'worldFromMark'
  | 'extentM'
  | 'number'
  | 'lengthM'
  | 'lengthSigmaM'
  | 'picture'
  | 'checkItems'
>;

/** A mark made here that the server has not answered yet. */
export interface PendingAnnotation extends Partial<MarkForm> {
  readonly requestId: string;
  readonly shape: Shape;
  readonly text: string;
  readonly pointInWorld: Vec3 | undefined; // our own estimate until the server's
  readonly sizeM: number;
  readonly colorRgba: number;
}

export interface Participant {
  readonly participantId: string;
  readonly name: string;
  readonly role: Role;
  readonly personId: string;
  readonly colorRgba: number; // the person's
  /** Has joined the voices. */
  readonly listens?: boolean;
}

/** The server's, over the last seconds. */
export interface Statistics {
  readonly capturedFps: number;
  readonly trackedFps: number;
  readonly encodedFps: number;
  readonly framesDropped: number;
  readonly badFrames: number;
  readonly eventsSkipped: number;
  readonly videoBitRate: number;
}

export type Target =
  | { readonly kind: 'pixel'; readonly frameId: number; readonly pixel: Pixel }
  | { readonly kind: 'feature'; readonly featureId: number }
  | { readonly kind: 'point'; readonly pointInWorld: Vec3 }
  | { readonly kind: 'ray'; readonly originInWorld: Vec3; readonly directionInWorld: Vec3 };

export type Link =
  | { readonly kind: 'connecting' }
  /** Somebody there has to let us in. */
  | { readonly kind: 'waiting' }
  /** As many tabs of this browser are connected as it has connections for. */
  | { readonly kind: 'crowded'; readonly tabs: number }
  | { readonly kind: 'live' }
  | { readonly kind: 'reconnecting'; readonly reason: string; readonly sinceMs: number }
  | { readonly kind: 'refused'; readonly reason: string };

/** What lengths mean now. */
export interface Scale {
  readonly metric: boolean; // world is in metres; false where that is not known
  readonly eye: Vec3 | undefined; // the wearer's camera
}

/** Above these a mark is not to be trusted: as the server has them by default. */
const LIMIT_MM = 50;
const LIMIT_OF_DISTANCE = 0.02; // where that is more
const LIMIT_PX = 10;

export interface Excess {
  readonly mm: boolean;
  readonly px: boolean;
}

/** Which of its expected errors is above its limit; without scale there are no millimetres. */
export function excessOf(anchor: Anchor, { metric, eye }: Scale): Excess {
  const { pointInWorld, errorMm, errorPx } = anchor;
  const away = eye && pointInWorld ? distance(eye, pointInWorld) : 0;
  const limitMm = Math.max(LIMIT_MM, 1000 * LIMIT_OF_DISTANCE * away);
  return { mm: metric && errorMm > limitMm, px: (errorPx ?? 0) > LIMIT_PX };
}

/**
 * An anchor whose place is not to be relied upon (drawn hollow and named so): as the server judges it,
 * and while it is provisional and not judged yet, by its expected error.
 */
export function doNotTrust(anchor: Anchor, scale: Scale): boolean {
  switch (anchor.state) {
    case 'paused':
    case 'stopped':
      return true;
    case 'provisional': {
      const { mm, px } = excessOf(anchor, scale);
      return mm || px;
    }
    case 'tracking':
      return false;
  }
}
