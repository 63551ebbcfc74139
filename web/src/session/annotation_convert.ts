import {
  AnchorState as PbAnchorState,
  AnnotationShape,
  type Anchor as PbAnchor,
  type Annotation as PbAnnotation,
} from '../gen/saccade/v1/annotation_pb';
import { covariance3 } from '../geometry/covariance';
import { toVec3 } from './convert';
import type { Anchor, AnchorState, Annotation, Shape } from './types';

const anchorStates: Record<PbAnchorState, AnchorState> = {
  [PbAnchorState.UNSPECIFIED]: 'provisional',
  [PbAnchorState.PROVISIONAL]: 'provisional',
  [PbAnchorState.TRACKING]: 'tracking',
  [PbAnchorState.PAUSED]: 'paused',
  [PbAnchorState.STOPPED]: 'stopped',
};

export const pbShapes: Record<Shape, AnnotationShape> = {
  cube: AnnotationShape.CUBE,
  note: AnnotationShape.NOTE,
  arrow: AnnotationShape.ARROW,
  ink: AnnotationShape.INK,
  box: AnnotationShape.BOX,
  measure: AnnotationShape.MEASURE,
  pin: AnnotationShape.PIN,
  picture: AnnotationShape.PICTURE,
  check_list: AnnotationShape.CHECK_LIST,
};

const shapes = new Map(Object.entries(pbShapes).map(([shape, pb]) => [pb, shape as Shape]));

export const toAnchor = (pb: PbAnchor | undefined): Anchor => ({
  state: anchorStates[pb?.state ?? PbAnchorState.UNSPECIFIED],
  pointInWorld: pb?.pointInWorldM && toVec3(pb.pointInWorldM),
  covariance: covariance3(pb?.covarianceInWorldM2?.upper ?? []),
  errorMm: pb?.errorMm ?? 0,
  errorPx: pb?.errorPx,
  reason: pb?.reason ?? '',
});

export function toAnnotation(pb: PbAnnotation): Annotation {
  const { worldFromMark: rotation, picture } = pb;
  return {
    id: pb.id,
    shape: shapes.get(pb.shape) ?? 'cube',
    text: pb.text,
    author: pb.author,
    sizeM: pb.sizeM > 0 ? pb.sizeM : 0.05,
    colorRgba: pb.colorRgba || 0xffffffff,
    createdMs: Number(pb.createdUnixNs) / 1e6,
    inkOffsetsM: pb.inkOffsetM.map(toVec3),
    anchor: toAnchor(pb.anchor),
    authorPersonId: pb.authorPersonId,
    locked: pb.locked,
    worldFromMark: rotation && { x: rotation.x, y: rotation.y, z: rotation.z, w: rotation.w },
    extentM: pb.extentM && toVec3(pb.extentM),
    number: pb.number,
    lengthM: pb.lengthM,
    lengthSigmaM: pb.lengthSigmaM,
    picture: picture && { sha256: picture.sha256, width: picture.width, height: picture.height },
    checkItems: pb.checkItems.map(({ text, done, doneBy }) => ({ text, done, doneBy })),
  };
}
