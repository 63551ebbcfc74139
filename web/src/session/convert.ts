import {
  AnchorState as PbAnchorState,
  AnnotationShape,
  type Anchor as PbAnchor,
  type Annotation as PbAnnotation,
} from '../gen/saccade/v1/annotation_pb';
import {
  CameraIntrinsics_Model as Model,
  type CameraIntrinsics,
  type Rigid3 as PbRigid3,
  type Vector3,
} from '../gen/saccade/v1/geometry_pb';
import {
  type Feature as PbFeature,
  FeatureState as PbFeatureState,
  type FrameFeatures as PbFrameFeatures,
} from '../gen/saccade/v1/map_pb';
import {
  type Participant as PbParticipant,
  Role as PbRole,
  type StatisticsEvent,
} from '../gen/saccade/v1/session_pb';
import {
  type PoseEvent,
  TrackingQuality as PbQuality,
  TrackingStatus as PbStatus,
} from '../gen/saccade/v1/tracking_pb';
import type { StageTimestamps } from '../gen/saccade/v1/video_pb';
import type { Intrinsics, LensModel } from '../geometry/camera';
import { covariance3 } from '../geometry/covariance';
import { IDENTITY, type Rigid3 } from '../geometry/rigid3';
import { type Vec3, ZERO } from '../geometry/vec3';
import type {
  Anchor,
  AnchorState,
  Annotation,
  Feature,
  FeatureState,
  FrameFeatures,
  Participant,
  Pose,
  Quality,
  Role,
  SeenFeature,
  Shape,
  Stages,
  Statistics,
  TrackingStatus,
} from './types';

const statuses: Record<PbStatus, TrackingStatus> = {
  [PbStatus.UNSPECIFIED]: 'unknown',
  [PbStatus.INITIALISING]: 'initialising',
  [PbStatus.TRACKING]: 'tracking',
  [PbStatus.COASTING]: 'coasting',
  [PbStatus.LOST]: 'lost',
  [PbStatus.RELOCALISING]: 'relocalising',
};

const qualities: Record<PbQuality, Quality> = {
  [PbQuality.UNSPECIFIED]: 'unknown',
  [PbQuality.BAD]: 'bad',
  [PbQuality.POOR]: 'poor',
  [PbQuality.GOOD]: 'good',
};

const featureStates: Record<PbFeatureState, FeatureState> = {
  [PbFeatureState.UNSPECIFIED]: 'not_attempted',
  [PbFeatureState.NOT_ATTEMPTED]: 'not_attempted',
  [PbFeatureState.MEASURED]: 'measured',
  [PbFeatureState.FAILED]: 'failed',
};

const anchorStates: Record<PbAnchorState, AnchorState> = {
  [PbAnchorState.UNSPECIFIED]: 'provisional',
  [PbAnchorState.PROVISIONAL]: 'provisional',
  [PbAnchorState.TRACKING]: 'tracking',
  [PbAnchorState.PAUSED]: 'paused',
  [PbAnchorState.STOPPED]: 'stopped',
};

const shapes: Partial<Record<AnnotationShape, Shape>> = {
  [AnnotationShape.UNSPECIFIED]: 'cube',
  [AnnotationShape.CUBE]: 'cube',
  [AnnotationShape.NOTE]: 'note',
  [AnnotationShape.ARROW]: 'arrow',
  [AnnotationShape.INK]: 'ink',
};

export const pbShapes: Record<Shape, AnnotationShape> = {
  cube: AnnotationShape.CUBE,
  note: AnnotationShape.NOTE,
  arrow: AnnotationShape.ARROW,
  ink: AnnotationShape.INK,
};

const roles: Record<PbRole, Role> = {
  [PbRole.UNSPECIFIED]: 'viewer',
  [PbRole.EXPERT]: 'expert',
  [PbRole.WEARER]: 'wearer',
  [PbRole.VIEWER]: 'viewer',
};

export const pbRoles: Record<Role, PbRole> = {
  expert: PbRole.EXPERT,
  wearer: PbRole.WEARER,
  viewer: PbRole.VIEWER,
};

const models: Record<Model, LensModel> = {
  [Model.UNSPECIFIED]: 'pinhole',
  [Model.PINHOLE]: 'pinhole',
  [Model.RADIAL1]: 'radial1',
  [Model.BROWN_CONRADY]: 'brown_conrady',
  [Model.KANNALA_BRANDT]: 'kannala_brandt',
  [Model.FOV]: 'fov',
};

const toVec3 = (v: Vector3 | undefined): Vec3 => (v ? { x: v.x, y: v.y, z: v.z } : ZERO);

function toRigid3(pb: PbRigid3 | undefined): Rigid3 {
  if (!pb?.rotation) return IDENTITY;
  const { x, y, z, w } = pb.rotation;
  return { rotation: { x, y, z, w }, translation: toVec3(pb.translationM) };
}

export function toIntrinsics(pb: CameraIntrinsics): Intrinsics {
  return {
    model: models[pb.model],
    width: pb.widthPx,
    height: pb.heightPx,
    fx: pb.fxPx,
    fy: pb.fyPx,
    cx: pb.cxPx,
    cy: pb.cyPx,
    distortion: pb.distortion,
  };
}

export function toPose(pb: PoseEvent): Pose {
  return {
    frameId: Number(pb.frameId),
    status: statuses[pb.status],
    quality: qualities[pb.quality],
    advice: pb.advice,
    metric: pb.metric,
    worldFromCamera: toRigid3(pb.worldFromCamera),
    attempted: pb.featuresAttempted,
    matched: pb.featuresMatched,
    mapRevision: Number(pb.mapRevision),
  };
}

export function toStages(pb: StageTimestamps | undefined): Stages {
  const ms = (ns: bigint | undefined): number => Number(ns ?? 0n) / 1e6;
  return {
    captured: ms(pb?.capturedNs),
    received: ms(pb?.receivedNs),
    tracked: ms(pb?.trackedNs),
    encoded: ms(pb?.encodedNs),
    queued: ms(pb?.queuedNs),
  };
}

export function toFeature(pb: PbFeature): Feature {
  return {
    id: Number(pb.id),
    state: featureStates[pb.state],
    pointInWorld: toVec3(pb.pointInWorldM),
    covariance: covariance3(pb.covarianceInWorldM2?.upper ?? []),
    depthKnown: pb.depthKnown,
    pixel: pb.pixel && { u: pb.pixel.u, v: pb.pixel.v },
    matchedCount: pb.matchedCount,
  };
}

/** Sixteenths of a pixel of the raw picture. */
export function toFrameFeatures(pb: PbFrameFeatures): FrameFeatures {
  const seen = new Map<number, SeenFeature>();
  const take = (state: SeenFeature['state'], ids: bigint[], px16: number[]): void => {
    ids.forEach((id, i) => {
      const [u, v] = [px16[2 * i], px16[2 * i + 1]];
      if (u === undefined || v === undefined) return;
      seen.set(Number(id), { state, pixel: { u: u / 16, v: v / 16 } });
    });
  };
  take('failed', pb.failedIds, pb.failedPx16);
  take('measured', pb.measuredIds, pb.measuredPx16);
  return seen;
}

export const toAnchor = (pb: PbAnchor | undefined): Anchor => ({
  state: anchorStates[pb?.state ?? PbAnchorState.UNSPECIFIED],
  pointInWorld: pb?.pointInWorldM && toVec3(pb.pointInWorldM),
  covariance: covariance3(pb?.covarianceInWorldM2?.upper ?? []),
  errorMm: pb?.errorMm ?? 0,
  errorPx: pb?.errorPx,
  reason: pb?.reason ?? '',
});

export function toAnnotation(pb: PbAnnotation): Annotation {
  return {
    id: pb.id,
    shape: shapes[pb.shape] ?? 'cube',
    text: pb.text,
    author: pb.author,
    sizeM: pb.sizeM > 0 ? pb.sizeM : 0.05,
    colorRgba: pb.colorRgba || 0xffffffff,
    createdMs: Number(pb.createdUnixNs) / 1e6,
    inkOffsetsM: pb.inkOffsetM.map(toVec3),
    anchor: toAnchor(pb.anchor),
  };
}

export const toParticipant = (pb: PbParticipant): Participant => ({
  participantId: pb.participantId,
  name: pb.displayName,
  role: roles[pb.role],
  listens: pb.listens,
});

export const toStatistics = (pb: StatisticsEvent): Statistics => ({
  capturedFps: pb.capturedFpsHz,
  trackedFps: pb.trackedFpsHz,
  encodedFps: pb.encodedFpsHz,
  framesDropped: Number(pb.framesDropped),
  badFrames: Number(pb.badFrames),
  eventsSkipped: Number(pb.eventsSkipped),
  videoBitRate: pb.videoBitRateBitS,
});
