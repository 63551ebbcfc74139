import { pageNowMs } from '../session/clock';
import { hasHead } from '../session/gaze';
import type { Session } from '../session/session';
import { h, isComposing, setClass, setText } from './dom';
import type { Player } from './player';
import { WearerHead } from './wearer_head';
import { presenceWords, statusWords } from './words';

const STALE_MS = 1000;

/** The wearer's view: the augmented picture, one line of words, a large pause. */
export class WearerApp {
  readonly element: HTMLElement;
  private readonly mark = h('span', { class: 'mark', 'aria-hidden': 'true' });
  private readonly words = h('span', {});
  private readonly line = h('p', { class: 'line', role: 'status' }, this.mark, this.words);
  private readonly watchers = h('p', { class: 'watchers' });
  private readonly pauseButton = h('button', { type: 'button', class: 'pause', title: 'P' });
  private readonly head: WearerHead;
  private readonly fullButton = h('button', { type: 'button', class: 'full' }, 'Full screen');
  private readonly notice = h('p', { class: 'notice', role: 'alert' });
  private paused = false;

  constructor(
    private readonly session: Session,
    private readonly player: Player,
  ) {
    this.head = new WearerHead(session);
    this.element = h(
      'div',
      { class: 'wearer-view' },
      player.canvas,
      this.line,
      this.watchers,
      this.notice,
      h('div', { class: 'buttons' }, this.head.stop, this.pauseButton, this.head.take),
      this.fullButton,
    );
    this.pauseButton.addEventListener('click', () => this.togglePause());
    this.fullButton.addEventListener('click', () => this.toggleFull());
    document.addEventListener('keydown', (event) => {
      // No key that also presses a button: what a press does is done once.
      if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
      if (isComposing(event)) return;
      const key = event.key.toLowerCase();
      if (key === 'p') this.togglePause();
      if (key === 'f') this.toggleFull();
      if (key === 'x') this.head.toggleStop();
    });
  }

  start(): void {
    requestAnimationFrame(() => this.frame());
  }

  private togglePause(): void {
    this.paused = !this.paused;
    this.update();
  }

  private toggleFull(): void {
    if (document.fullscreenElement) void document.exitFullscreen();
    else document.documentElement.requestFullscreen().catch(() => undefined);
  }

  private frame(): void {
    requestAnimationFrame(() => this.frame());
    if (!this.paused) this.player.draw();
    this.update();
  }

  private update(): void {
    const { session, player, paused } = this;
    const { link, pose, poseMs, sourceEnded } = session;
    const words = statusWords({ link, pose, poseMs, sourceEnded, nowMs: pageNowMs() });
    const text = [words.text, words.advice].filter(Boolean).join(': ');
    const age = player.shown ? pageNowMs() - player.shown.drawnMs : 0;
    const stale = age > STALE_MS && !paused && !sourceEnded;
    // While the picture is live it has its status burned in: one line is enough.
    const burnedIn = link.kind === 'live' && player.shown && !paused && !stale && !sourceEnded;
    setClass(this.line, 'hidden', burnedIn === true);
    setText(this.mark, paused ? 'Ⅱ' : words.mark);
    // Nothing reaches the camera from here yet: say what a pause is, and what it is not.
    setText(this.words, paused ? 'picture held here; experts still see the camera' : text);
    setClass(this.line, 'warn', words.warn || paused);
    setText(this.watchers, session.live ? watcherWords(session) : '');
    setText(this.pauseButton, paused ? '▶ Go on' : 'Ⅱ Pause picture');
    setText(this.fullButton, document.fullscreenElement ? 'Leave full screen' : 'Full screen');
    this.head.update();
    setText(this.notice, this.head.problem || noticeWords(player, stale ? age : 0));
    setClass(this.element, 'stale', stale);
  }
}

function watcherWords({ participants, gaze, participantId }: Session): string {
  const others = presenceWords(participants.filter(({ role }) => role !== 'wearer'));
  const watching = others ? `${others} watching` : 'nobody watches';
  if (!hasHead(gaze)) return watching;
  if (gaze.paused) return `${watching} · head stopped`;
  if (!gaze.pilot) return watching;
  return `${watching} · ${gaze.pilot.participantId === participantId ? 'you pilot' : `${gaze.pilot.name} pilots`}`;
}

function noticeWords(player: Player, staleMs: number): string {
  if (player.unsupported) return `No video. ${player.unsupported}`;
  return staleMs > 0 ? `This picture is ${(staleMs / 1000).toFixed(0)} s old` : '';
}
