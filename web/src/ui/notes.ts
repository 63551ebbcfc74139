import { EditError, type Edits } from '../session/edits';
import type { Session } from '../session/session';
import { newUuid } from '../session/uuid';
import type { Landing } from '../tools/landing';
import { bytesOf, cleanText, MAX_TEXT_BYTES, roomWords } from '../tools/note_text';
import type { AppState } from './app_state';
import { isTextField } from './dom';
import { KEEPS_OPEN, NoteEditor } from './note_editor';
import { shapeWord } from './words';

/** Where a new note is to stand. */
interface Spot {
  readonly landing: Landing;
  readonly sessionId: string; // whose frames and features `landing` names
  readonly mapRevision: number | undefined; // the map whose coordinates its rays have
}

/** A note being typed. */
interface Draft {
  readonly id: string; // of the note; empty: a new one
  readonly text: string;
  readonly problem: string;
  readonly spot: Spot | undefined;
  readonly pendingId: string; // its mark while it is typed; empty: none
}

const HOLD_MS = 5000; // the server keeps a frame for 10 s, and longer once it was asked for

/**
 * Notes from the click to the server's answer. The editor opens with the click, whatever becomes of
 * it: whoever has chosen the note and clicked is typing, and no key of that may be a command. The note
 * is placed when its text is done, where the click was: so Escape leaves nothing, and one undo takes
 * back all of it. A note that was refused comes back with its text.
 */
export class Notes {
  readonly editor = new NoteEditor({
    finish: () => void this.finish(),
    cancel: () => this.cancel(),
  });
  private draft: Draft | undefined;
  private readonly refused: Draft[] = []; // come back once the editor is free
  private clickFinished = false;
  private holdTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly session: Session,
    private readonly edits: Edits,
    private readonly state: AppState,
  ) {}

  /** Sees pointer and keys before the rest of the page. */
  listen(): void {
    document.addEventListener('pointerdown', (event) => this.pointerDown(event), { capture: true });
    document.addEventListener('keydown', (event) => this.keyDown(event), { capture: true });
  }

  /** True once for a click that only finished a note. */
  takeClick(): boolean {
    const { clickFinished } = this;
    this.clickFinished = false;
    return clickFinished;
  }

  /** A click with the note tool: opens the editor, or moves the note that is open and not kept yet. */
  click(landing: Landing | undefined, whyNot: string): void {
    const { draft } = this;
    const text = draft ? this.editor.text : '';
    if (draft) this.put(undefined);
    const { sessionId, pose } = this.session;
    const spot = landing && { landing, sessionId, mapRevision: pose?.mapRevision };
    const problem = spot ? '' : `Not placed: ${whyNot} Click where it belongs.`;
    this.put({ id: '', text, problem, spot, pendingId: spot ? this.showMark(landing) : '' });
    if (spot) this.hold(landing);
  }

  /** The text of a note that is there already. */
  edit(id: string): void {
    const annotation = this.session.annotations.get(id);
    if (!annotation) return;
    if (this.draft && !this.finish()) return;
    this.put({ id, text: annotation.text, problem: '', spot: undefined, pendingId: '' });
  }

  private cancel(): void {
    this.put(undefined);
    this.next();
  }

  /** Keeps what was typed; false if the editor has to stay, which then says why. */
  private finish(): boolean {
    const { draft } = this;
    if (!draft) return true;
    const text = cleanText(this.editor.text);
    const before = draft.id ? this.session.annotations.get(draft.id)?.text : '';
    if (text !== '' && text !== before) {
      const problem = this.problemOf(draft, text);
      if (problem) {
        this.draft = { ...draft, problem };
        this.editor.say(problem);
        this.editor.focus();
        return false;
      }
      this.put(undefined);
      void this.send({ ...draft, text });
    } else {
      this.put(undefined);
    }
    this.next();
    return true;
  }

  private problemOf({ id, spot, problem }: Draft, text: string): string {
    if (bytesOf(text) > MAX_TEXT_BYTES) return `Not kept: ${roomWords(text).text}.`;
    if (!this.session.live) return 'Not kept: no connection to the server. Enter tries again.';
    if (id) return '';
    if (!spot) return problem;
    if (spot.sessionId !== this.session.sessionId) {
      return 'Not placed: the connection was begun anew since the click. Click where it belongs.';
    }
    return spot.landing.target.kind === 'ray' && !this.sameMap(spot)
      ? 'Not placed: the map has changed since the click. Click where it belongs.'
      : '';
  }

  private sameMap({ mapRevision }: Spot): boolean {
    return mapRevision === this.session.pose?.mapRevision;
  }

  private async send(draft: Draft): Promise<void> {
    const { state, edits } = this;
    const { id, text, spot } = draft;
    try {
      if (id) {
        await edits.change(id, { text });
      } else if (spot) {
        const { target, pointInWorld } = spot.landing;
        const later = this.sameMap(spot) ? spot.landing.later : undefined;
        const { colorRgba } = state;
        const guess = { guessInWorld: pointInWorld, target, later };
        const placed = await edits.place({ shape: 'note', text, colorRgba, ...guess });
        if (!this.draft) state.selectedId = placed.id;
      }
    } catch (error) {
      const reason = error instanceof EditError ? error.message : String(error);
      const remedy = id ? 'Enter tries again' : 'Enter tries again, or click where it belongs';
      const problem = `Not ${id ? 'changed' : 'placed'}: ${reason}. ${remedy}.`;
      this.refused.push({ ...draft, problem, pendingId: '' });
      this.next();
    }
    state.changed();
  }

  /** What was refused meanwhile. */
  private next(): void {
    if (this.draft) return;
    const back = this.refused.shift();
    if (back) this.put(back);
  }

  private put(draft: Draft | undefined): void {
    clearTimeout(this.holdTimer);
    if (this.draft?.pendingId) this.session.annotations.removePending(this.draft.pendingId);
    this.draft = draft;
    if (draft) {
      this.state.selectedId = draft.id || undefined; // a colour chosen now is for this one
      this.editor.open(draft.id ? this.nameOf(draft.id) : 'New note', draft.text, draft.problem);
    } else {
      this.editor.close();
    }
    this.state.changed();
  }

  private nameOf(id: string): string {
    const shape = this.session.annotations.get(id)?.shape ?? 'note';
    return shape === 'note' ? 'Note' : `Words of this ${shapeWord(shape)}`;
  }

  /** Shown hollow where it will stand, until it is placed. */
  private showMark({ pointInWorld }: Landing): string {
    const requestId = newUuid();
    const { colorRgba } = this.state;
    const mark = { shape: 'note', text: 'new note', sizeM: 0.05, colorRgba } as const;
    this.session.annotations.addPending({ requestId, pointInWorld, ...mark });
    return requestId;
  }

  /** Who types for long still means the frame that was clicked. */
  private hold({ target }: Landing): void {
    if (target.kind !== 'pixel') return;
    const { frameId } = target;
    this.holdTimer = setTimeout(() => {
      this.session.fetchPng(frameId).catch(() => undefined); // then the ray has to do
    }, HOLD_MS);
  }

  private pointerDown({ target }: PointerEvent): void {
    this.clickFinished = false;
    const { draft } = this;
    if (!draft || (target instanceof Element && target.closest(KEEPS_OPEN))) return;
    const unkept = draft.id === '' && (draft.problem !== '' || this.editor.text.trim() === '');
    const inPane = target instanceof Element && target.closest('.pane') !== null;
    if (unkept && inPane && this.state.tool === 'note') return; // moves it
    this.clickFinished = inPane;
    this.finish();
  }

  private keyDown(event: KeyboardEvent): void {
    this.clickFinished = false; // that press became no click
    if (!this.draft) return;
    const { target } = event;
    if (isTextField(target) || event.ctrlKey || event.metaKey || event.altKey) return;
    const chosen = target instanceof Element && target.closest('.palette button') !== null;
    if (chosen && [' ', 'Enter', 'Tab'].includes(event.key)) return; // chooses a colour by key
    // The focus was lost, not the wish to type: this key is text as well.
    event.stopImmediatePropagation();
    this.editor.focus();
    this.editor.command(event);
  }
}
