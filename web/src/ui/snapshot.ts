import { type Mark, strokesOf } from '../scene/strokes';
import type { View } from '../geometry/view';
import type { Annotation, FrameFacts } from '../session/types';
import { withText } from '../tools/png_text';
import type { ShownPicture } from './mark_painter';
import { Painter } from './painter';

export const KEYWORD = 'Saccade';

/** What a snapshot says of itself. */
export interface SnapshotFacts {
  readonly facts: FrameFacts;
  readonly source: string;
  readonly takenBy: string;
  readonly metric: boolean;
  readonly annotations: readonly Annotation[];
}

/** The picture at its own size with the marks of that very frame, as PNG with its data inside. */
export async function takeSnapshot(
  picture: HTMLCanvasElement,
  view: View | undefined,
  {
    marks,
    pictures,
  }: { readonly marks: readonly Mark[]; readonly pictures: readonly ShownPicture[] },
  about: SnapshotFacts,
): Promise<Blob> {
  const { width, height } = picture;
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext('2d', { alpha: false });
  if (!context) throw new Error('this browser has no 2D canvas');
  context.drawImage(picture, 0, 0);
  if (view) {
    const painter = new Painter(1);
    painter.begin({ width, height }, { left: 0, top: 0, scale: 1 });
    painter.pictures(pictures);
    painter.marks(strokesOf(view, marks), []);
    context.drawImage(painter.canvas, 0, 0);
  }
  const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, 'image/png'));
  if (!blob) throw new Error('this browser could not make a PNG of it');
  const png = new Uint8Array(await blob.arrayBuffer());
  return new Blob([withText(png, KEYWORD, JSON.stringify(describe(about)))], {
    type: 'image/png',
  });
}

function describe({ facts, source, takenBy, metric, annotations }: SnapshotFacts): unknown {
  const { frameId, pose, camera, stages } = facts;
  return {
    taken: new Date().toISOString(),
    takenBy,
    source,
    frameId,
    capturedMs: stages.captured,
    metric,
    status: pose?.status,
    worldFromCamera: pose?.worldFromCamera,
    intrinsics: camera.intrinsics,
    marks: annotations.map(({ id, shape, text, author, anchor }) => ({
      ...{ id, shape, text, author, state: anchor.state, pointInWorld: anchor.pointInWorld },
      ...{ errorMm: metric ? anchor.errorMm : undefined, errorPx: anchor.errorPx },
    })),
  };
}

/** Hands a file to the person. */
export function save(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
