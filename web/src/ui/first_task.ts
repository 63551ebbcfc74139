import type { Session } from '../session/session';
import type { MapPane } from './map_pane';
import { h, setClass, setText, storage } from './dom';
import type { VideoPane } from './video_pane';

const KEY = 'saccade.firstTask';
const SIMULATED = /^sim:/;

interface Step {
  readonly words: string;
  readonly done: () => boolean;
}

/**
 * A first task on the demo: a note on the mug, a frozen picture, a look behind it in the map. Once in a
 * browser's life, and again when help is asked for it; it waits for what is done, and hinders nothing.
 */
export class FirstTask {
  readonly element: HTMLElement;
  private readonly title = h('strong', {});
  private readonly words = h('p', { role: 'status' });
  private readonly skip = h('button', { type: 'button' });
  private step = -1; // -1: not under way
  private notes = new Set<string>(); // those there were
  private view = ''; // of the map, when its step began
  private readonly steps: readonly Step[];

  constructor(
    private readonly session: Session,
    private readonly map: MapPane,
    private readonly video: VideoPane,
  ) {
    this.steps = [
      {
        words:
          'Place a note on the mug: choose Note (N), click the mug in the video or the map, write what it is, and press Enter.',
        done: () => this.mine().some((id) => !this.notes.has(id)),
      },
      {
        words: 'Freeze the picture (P). It stands still; the map goes on.',
        done: () => this.video.frozen,
      },
      {
        words: 'Look behind the mug: drag in the map to go round it. Your note stays where it is.',
        done: () => this.view !== '' && this.eye() !== this.view,
      },
    ];
    this.skip.addEventListener('click', () => this.finish());
    this.element = h(
      'section',
      { class: 'first-task hidden', 'aria-label': 'First task' },
      this.title,
      this.words,
      this.skip,
    );
  }

  /** Once more, whatever was before. */
  begin(): void {
    this.step = 0;
    this.notes = new Set(this.mine());
    this.show();
  }

  /** Once per screen frame. */
  update(): void {
    if (this.step < 0) return this.offer();
    if (this.steps[this.step]?.done() !== true) return;
    ++this.step;
    if (this.step === this.steps.length) this.remember();
    this.view = this.eye();
    this.show();
  }

  /** To who sees this page for the first time, and the simulated wearable. */
  private offer(): void {
    const { session } = this;
    const known = storage().getItem(KEY) !== null;
    if (known || !session.live || session.pose?.status !== 'tracking') return;
    if (SIMULATED.test(session.joined?.source ?? '')) this.begin();
  }

  private show(): void {
    const { step, steps } = this;
    const current = steps[step];
    setText(this.title, current ? `First task, ${step + 1} of ${steps.length}` : 'Well done');
    setText(
      this.words,
      current?.words ?? 'That is how you show where. P goes on; ? has all keys and this task.',
    );
    setText(this.skip, current ? 'Skip' : 'Close');
    setClass(this.element, 'hidden', false);
  }

  private finish(): void {
    this.step = -1;
    this.remember();
    setClass(this.element, 'hidden', true);
  }

  private remember(): void {
    try {
      storage().setItem(KEY, 'done');
    } catch {
      // Full: then it is offered again.
    }
  }

  private mine(): string[] {
    const { annotations, displayName } = this.session;
    const notes = annotations.list().filter(({ shape, author }) => {
      return shape === 'note' && author === displayName;
    });
    return notes.map(({ id }) => id);
  }

  /** Which way the map is looked at; what it does by itself does not change that. */
  private eye(): string {
    const q = this.map.view()?.worldFromCamera.rotation;
    return q ? [q.x, q.y, q.z, q.w].map((value) => value.toFixed(2)).join(' ') : '';
  }
}
