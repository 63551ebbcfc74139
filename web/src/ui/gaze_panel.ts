import { hasHead } from '../session/gaze';
import type { GazePilot } from '../session/gaze_pilot';
import type { Session } from '../session/session';
import { type Control, HEAD_COMMANDS, type HeadCommandName } from '../tools/tools';
import type { AppState } from './app_state';
import { h, icon, setClass, setText } from './dom';
import type { HeadActions } from './gaze_controller';
import { directionWords, gazeWords, steerWords } from './gaze_words';
import { HeadDial } from './head_dial';
import { ICONS } from './icons';

/** What the head does, how far off it is, who steers it, and what can be asked of it. */
export class GazePanel {
  readonly element: HTMLElement;
  private readonly mark = h('span', { class: 'mark', 'aria-hidden': 'true' });
  private readonly text = h('span', {});
  private readonly number = h('span', { class: 'error number' });
  private readonly angles = h('p', { class: 'angles number' });
  private readonly advice = h('p', { class: 'advice', role: 'status' });
  private readonly steer = h('p', { class: 'steer', role: 'status' });
  private readonly reason = h('p', { class: 'why', role: 'alert' });
  private readonly dial = new HeadDial();
  private readonly buttons = new Map<HeadCommandName, HTMLButtonElement>();
  private readonly leaseLabel = h('span', {});
  private readonly controls = h('div', { class: 'controls', role: 'group', 'aria-label': 'Head' });

  constructor(
    private readonly session: Session,
    private readonly pilot: GazePilot,
    private readonly state: AppState,
    private readonly actions: HeadActions,
  ) {
    for (const control of HEAD_COMMANDS) this.addButton(control);
    this.element = h(
      'section',
      { class: 'gaze', 'aria-label': 'Gaze' },
      h('h2', {}, 'Gaze', this.number, this.dial.element),
      h('p', { class: 'doing', role: 'status' }, this.mark, this.text),
      this.angles,
      this.advice,
      this.steer,
      this.controls,
      this.reason,
    );
  }

  private addButton({ name, label, shown, hint }: Control<HeadCommandName>): void {
    const words = name === 'lease' ? this.leaseLabel : h('span', {}, label);
    const button = h(
      'button',
      { type: 'button', 'data-control': name, title: `${hint} (${shown})` },
      icon(ICONS[name]),
      words,
      h('kbd', { 'aria-hidden': 'true' }, shown),
    );
    button.setAttribute('aria-keyshortcuts', shown);
    button.addEventListener('click', () => this.actions.run(name));
    this.buttons.set(name, button);
    this.controls.append(button);
  }

  update(): void {
    const { session, pilot, state } = this;
    const head = hasHead(session.gaze);
    const gaze = session.live ? session.gaze : undefined;
    const target = gaze?.target;
    const annotation =
      target?.kind === 'annotation' ? session.annotations.get(target.annotationId) : undefined;
    const words = gazeWords({ gaze, annotation });
    setText(this.mark, words.mark);
    setText(this.text, words.text);
    this.text.title = annotation?.text ?? ''; // all of it: the words may be cut
    setText(this.number, words.number);
    setText(this.advice, words.advice);
    setClass(this.element, 'warn', words.warn);
    setClass(this.element, 'fixed', !head);
    this.element.dataset['mode'] = gaze?.mode ?? ''; // for tests
    this.element.dataset['arrived'] = String(gaze?.arrived ?? false);
    this.dial.update(gaze?.angles);
    setText(this.angles, gaze?.angles ? directionWords(gaze.angles) : '');
    const { participantId: me, participants } = session;
    const steering = hasHead(gaze)
      ? steerWords({ gaze, lease: pilot.lease, me, participants })
      : '';
    setText(this.steer, steering);
    setText(this.reason, state.refusal('head') ?? pilot.lost);
    this.updateButtons();
  }

  private updateButtons(): void {
    const { pilot, session } = this;
    const waits = session.gaze?.pilot && session.gaze.pilot.participantId !== session.participantId;
    const label = { none: waits ? 'Queue' : 'Pilot', waiting: 'Leave', held: 'Release' };
    setText(this.leaseLabel, label[pilot.lease.kind]);
    const fast = this.buttons.get('fast');
    fast?.setAttribute('aria-pressed', String(this.state.fast));
    if (fast) setClass(fast, 'on', this.state.fast);
    const lease = this.buttons.get('lease');
    if (lease) setClass(lease, 'on', pilot.lease.kind !== 'none');
  }
}
