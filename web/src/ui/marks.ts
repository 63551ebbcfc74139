import type { Annotation, Scale } from '../session/types';
import { colourOf, type Mark, markOf } from '../scene/strokes';
import type { AnnotationBook } from '../session/annotation_book';

/** Everything to draw: the server's annotations, and ours that it has not answered yet. */
export function allMarks(
  book: AnnotationBook,
  scale: Scale,
  drawn: (annotation: Annotation) => boolean = () => true,
): Mark[] {
  const marks = book
    .list()
    .filter(drawn)
    .map((annotation) => markOf(annotation, scale))
    .filter((mark) => mark !== undefined);
  for (const pending of book.pendingList()) {
    if (!pending.pointInWorld) continue;
    marks.push({
      id: '',
      shape: pending.shape,
      text: pending.text || 'placing',
      sizeM: pending.sizeM,
      pointInWorld: pending.pointInWorld,
      inkOffsetsM: [],
      colour: colourOf(pending),
      hollow: true,
    });
  }
  return marks;
}
