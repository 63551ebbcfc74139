import { create, type MessageInitShape } from '@bufbuild/protobuf';
import type { AnnotationTargetSchema } from '../gen/saccade/v1/annotation_pb';
import { PixelSchema, Vector3Schema } from '../gen/saccade/v1/geometry_pb';
import type { Vec3 } from '../geometry/vec3';
import type { Target } from './types';

export const toVector = (v: Vec3) => create(Vector3Schema, { x: v.x, y: v.y, z: v.z });

export function toTarget(target: Target): MessageInitShape<typeof AnnotationTargetSchema> {
  switch (target.kind) {
    case 'pixel':
      return {
        target: {
          case: 'framePixel',
          value: {
            frameId: BigInt(target.frameId),
            pixel: create(PixelSchema, { u: target.pixel.u, v: target.pixel.v }),
          },
        },
      };
    case 'feature':
      return { target: { case: 'featureId', value: BigInt(target.featureId) } };
    case 'point':
      return { target: { case: 'pointInWorldM', value: toVector(target.pointInWorld) } };
    case 'ray':
      return {
        target: {
          case: 'ray',
          value: {
            originInWorldM: toVector(target.originInWorld),
            directionInWorld: toVector(target.directionInWorld),
          },
        },
      };
  }
}
