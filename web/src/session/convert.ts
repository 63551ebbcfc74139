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
  Feature,
  FeatureState,
  FrameFeatures,
  Participant,
  Pose,
  Quality,
  Role,
  SeenFeature,
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

export const toVec3 = (v: Vector3 | undefined): Vec3 => (v ? { x: v.x, y: v.y, z: v.z } : ZERO);

export function toRigid3(pb: PbRigid3 | undefined): Rigid3 {
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
    markers: pb.markers.map(({ family, id, worldFromMarker }) => ({
      ...{ family, id, worldFromMarker: toRigid3(worldFromMarker) },
    })),
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

export const toParticipant = (pb: PbParticipant): Participant => ({
  participantId: pb.participantId,
  name: pb.displayName,
  role: roles[pb.role],
  personId: pb.personId,
  colorRgba: pb.colorRgba,
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
