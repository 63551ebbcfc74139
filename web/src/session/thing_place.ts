import { compose, IDENTITY, type Rigid3 } from '../geometry/rigid3';
import type { Vec3 } from '../geometry/vec3';
import type { Thing } from './scene_book';
import type { MarkerPose } from './types';

/** Where an annotation is, by its id. */
export type PlaceOf = (annotationId: string) => Vec3 | undefined;

/** Where a thing is; undefined where it is fixed to something whose place is not known. */
export function worldFromThing(
  thing: Thing,
  placeOf: PlaceOf,
  markers: readonly MarkerPose[],
): Rigid3 | undefined {
  const { marker, annotationId, parentFromObject } = thing;
  if (marker) {
    const found = markers.find(({ family, id }) => family === marker.family && id === marker.id);
    return found && compose(found.worldFromMarker, parentFromObject);
  }
  if (annotationId === '') return parentFromObject;
  const translation = placeOf(annotationId);
  return translation && compose({ ...IDENTITY, translation }, parentFromObject);
}

/** Whether it moves with something. */
export const isFixed = ({ annotationId, marker }: Thing): boolean =>
  annotationId !== '' || marker !== undefined;
