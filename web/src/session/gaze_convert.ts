import type { MessageInitShape } from '@bufbuild/protobuf';
import {
  GazeMode as PbMode,
  type GazePilot as PbPilot,
  type GazeState,
  type GazeTarget as PbTarget,
  type GazeTargetSchema,
} from '../gen/saccade/v1/gaze_pb';
import type { Gaze, GazeMode, GazeTarget, HeadAngles, Pilot } from './gaze';

const modes: Record<PbMode, GazeMode> = {
  [PbMode.UNSPECIFIED]: 'no_mount',
  [PbMode.NO_MOUNT]: 'no_mount',
  [PbMode.IDLE]: 'idle',
  [PbMode.SACCADE]: 'saccade',
  [PbMode.FIXATE]: 'fixate',
  [PbMode.HORIZON]: 'horizon',
  [PbMode.HOME]: 'home',
  [PbMode.STOPPED]: 'stopped',
  [PbMode.EXPLORE]: 'explore',
  [PbMode.PARKED]: 'parked',
};

const toPilot = (pb: PbPilot): Pilot => ({
  participantId: pb.participantId,
  name: pb.displayName || 'somebody',
});

function toAngles(pb: GazeState): HeadAngles | undefined {
  if (pb.panRad === undefined || pb.elevationRad === undefined) return undefined;
  const cyclotorsion = pb.cyclotorsionRad ?? 0;
  return { pan: pb.panRad, elevation: pb.elevationRad, cyclotorsion };
}

function toTarget(pb: PbTarget | undefined): GazeTarget | undefined {
  const target = pb?.target;
  switch (target?.case) {
    case 'annotationId':
      return { kind: 'annotation', annotationId: target.value };
    case 'featureId':
      return { kind: 'feature', featureId: Number(target.value) };
    case 'pointInWorldM': {
      const { x, y, z } = target.value;
      return { kind: 'point', pointInWorld: { x, y, z } };
    }
    case undefined:
      return undefined;
  }
}

export function toGaze(pb: GazeState): Gaze {
  const at = pb.targetInWorldM;
  return {
    mode: modes[pb.mode],
    angles: toAngles(pb),
    target: toTarget(pb.target),
    targetInWorld: at && { x: at.x, y: at.y, z: at.z },
    errorRad: pb.errorRad,
    arrived: pb.arrived,
    targetLost: pb.targetLost,
    unreachable: pb.unreachable,
    missRad: pb.missRad,
    fast: pb.fast,
    problem: pb.problem,
    pilot: pb.pilot && toPilot(pb.pilot),
    queue: pb.queue.map(toPilot),
    paused: pb.paused,
    handovers: Number(pb.handovers),
    lastHandover: pb.lastHandover,
    guidanceRad: pb.guidanceRad,
    timeNs: pb.timeNs,
  };
}

export function fromTarget(target: GazeTarget): MessageInitShape<typeof GazeTargetSchema> {
  switch (target.kind) {
    case 'annotation':
      return { target: { case: 'annotationId', value: target.annotationId } };
    case 'feature':
      return { target: { case: 'featureId', value: BigInt(target.featureId) } };
    case 'point': {
      const { x, y, z } = target.pointInWorld;
      return {
        target: { case: 'pointInWorldM', value: { $typeName: 'saccade.v1.Vector3', x, y, z } },
      };
    }
  }
}
