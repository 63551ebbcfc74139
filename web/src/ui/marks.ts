import type { Annotation, Scale } from '../session/types';
import { makeMark, type Mark, markOf } from '../scene/strokes';
import type { AnnotationBook } from '../session/annotation_book';

/** Everything to draw: the server's annotations, and ours that it has not answered yet. */
export function allMarks(
  book: AnnotationBook,
  scale: Scale,
  drawn: (annotation: Annotation) => boolean = () => true,
): Mark[] {
  const marks: Mark[] = [];
  for (const annotation of book.list()) {
    const mark = drawn(annotation) ? markOf(annotation, scale) : undefined;
    if (mark) marks.push(mark);
  }
  for (const pending of book.pendingList()) {
    const { pointInWorld, shape } = pending;
    if (!pointInWorld) continue;
    // A line that is being drawn is not in doubt, and what it is can be seen.
    const line = shape === 'ink' || shape === 'measure';
    const form = { ...NO_FORM, ...pending, text: pending.text || (line ? '' : 'placing') };
    marks.push(makeMark(form, { id: '', author: '', pointInWorld, hollow: !line }, scale));
  }
  return marks;
}

const NO_FORM = {
  inkOffsetsM: [],
  ...{ worldFromMark: undefined, extentM: undefined, picture: undefined },
  ...{ number: 0, lengthM: 0, lengthSigmaM: 0 },
  checkItems: [],
} as const;
