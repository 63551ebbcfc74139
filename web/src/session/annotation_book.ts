import type { AnnotationEvent } from '../gen/saccade/v1/session_pb';
import { toAnchor, toAnnotation } from './annotation_convert';
import type { Annotation, PendingAnnotation } from './types';

type Preview = (annotation: Annotation) => Annotation;

/** The server's annotations, with what this page has asked for and not heard back of. */
export class AnnotationBook {
  private readonly known = new Map<string, Annotation>();
  private readonly pending = new Map<string, PendingAnnotation>();
  private readonly leaving = new Set<string>();
  private readonly gone = new Set<string>();
  private readonly previews = new Map<string, Preview>();
  private listed: Annotation[] = [];
  private listedVersion = -1;
  /** Rises with every change. */
  version = 0;
  /** Rises with every change but those of live estimates alone, which come with each frame. */
  changes = 0;

  /** Of a state in parts only the first is `full`: the others add to it. */
  apply(event: AnnotationEvent): void {
    if (event.full) this.known.clear();
    for (const pb of event.upserted) {
      this.known.set(pb.id, toAnnotation(pb));
      this.gone.delete(pb.id);
    }
    for (const { id, anchor } of event.anchors) {
      const known = this.known.get(id);
      if (known) this.known.set(id, { ...known, anchor: toAnchor(anchor) });
    }
    for (const id of event.removedIds) {
      this.known.delete(id);
      this.gone.add(id);
      this.leaving.delete(id);
    }
    ++this.version;
    if (event.full || event.upserted.length > 0 || event.removedIds.length > 0) ++this.changes;
  }

  private changed(): void {
    ++this.version;
    ++this.changes;
  }

  /** The answer to a request of ours, usually ahead of the stream's; late, it may be gone by then. */
  put(annotation: Annotation): void {
    if (this.gone.has(annotation.id)) return;
    this.known.set(annotation.id, annotation);
    this.changed();
  }

  /** Oldest first, without those being deleted. */
  list(): readonly Annotation[] {
    if (this.listedVersion === this.version) return this.listed;
    this.listed = [...this.known.values()]
      .filter(({ id }) => !this.leaving.has(id))
      .sort((a, b) => a.createdMs - b.createdMs || a.id.localeCompare(b.id))
      .map((annotation) => this.previews.get(annotation.id)?.(annotation) ?? annotation);
    this.listedVersion = this.version;
    return this.listed;
  }

  get(id: string): Annotation | undefined {
    return this.leaving.has(id) ? undefined : this.known.get(id);
  }

  pendingList(): PendingAnnotation[] {
    return [...this.pending.values()];
  }

  addPending(pending: PendingAnnotation): void {
    this.pending.set(pending.requestId, pending);
    ++this.version;
  }

  removePending(requestId: string): void {
    if (this.pending.delete(requestId)) ++this.version;
  }

  /** Shows an annotation as it would be, until `endPreview`. */
  preview(id: string, as: Preview): void {
    this.previews.set(id, as);
    ++this.version;
  }

  endPreview(id: string): void {
    if (this.previews.delete(id)) ++this.version;
  }

  /** Hides an annotation while its deletion is under way; `undo` shows it again. */
  hide(id: string): () => void {
    this.leaving.add(id);
    this.changed();
    return () => {
      this.leaving.delete(id);
      this.changed();
    };
  }
}
