import { pageNowMs } from '../session/clock';
import { hasHead } from '../session/gaze';
import { isRecorder } from '../session/recording';
import type { Session } from '../session/session';
import { VoiceRoom } from '../talk/voice_room';
import { Chime } from './chime';
import { h, isComposing, setClass, setText } from './dom';
import { NewsWatch } from './news';
import { PauseControl } from './pause_control';
import type { Player } from './player';
import { RecordControl } from './record_control';
import { SpokenPause } from './spoken_pause';
import { WearerHead } from './wearer_head';
import { clockWords, statusWords } from './words';

const STALE_MS = 1000;
const NEWS_MS = 1500; // how long news is lit

const button = (className: string, title: string): HTMLButtonElement =>
  h('button', { type: 'button', class: className, title });

/**
 * The wearer's view: the augmented picture with its marks, one line of what was said last, who watches
 * and who steers, one large pause for everybody's picture and a smaller one for the head.
 */
export class WearerApp {
  readonly element: HTMLElement;
  private readonly mark = h('span', { class: 'mark', 'aria-hidden': 'true' });
  private readonly words = h('span', {});
  private readonly line = h('p', { class: 'line', role: 'status' }, this.mark, this.words);
  private readonly watchers = h('p', { class: 'watchers' });
  private readonly news = h('p', { class: 'news', role: 'status', dir: 'auto' });
  private readonly notice = h('p', { class: 'notice', role: 'alert' });
  private readonly pauseButton = button('pause', 'P');
  private readonly pausedWords = h('p', { class: 'paused-words', role: 'status' });
  private readonly fullButton = button('small full', 'F');
  private readonly soundButton = button('small sound', 'S');
  private readonly spokenButton = button('small spoken', 'say “pause picture” or “go on”');
  private readonly voiceButton = button('small voice', 'V');
  private readonly muteButton = button('small mute', 'M');
  private readonly head: WearerHead;
  private readonly record: RecordControl;
  private readonly pause: PauseControl;
  private readonly chime = new Chime();
  private readonly watch: NewsWatch;
  private readonly spoken: SpokenPause;
  private readonly room: VoiceRoom;

  constructor(
    private readonly session: Session,
    private readonly player: Player,
  ) {
    this.head = new WearerHead(session);
    this.record = new RecordControl(session);
    this.record.button.classList.add('small');
    this.pause = new PauseControl(session);
    this.spoken = new SpokenPause((paused) => this.pause.set(paused));
    this.watch = new NewsWatch(session, () => this.chime.play());
    this.room = new VoiceRoom(session);
    const small = h('div', { class: 'small-row' });
    small.append(this.voiceButton, this.muteButton, this.soundButton);
    if (SpokenPause.supported) small.append(this.spokenButton);
    small.append(this.record.button, this.fullButton);
    const head = h('div', { class: 'head-row' }, this.head.stop, this.head.take);
    this.element = h(
      'main',
      { class: 'wearer-view' },
      player.canvas,
      h('div', { class: 'top' }, this.line, this.watchers),
      this.pausedWords,
      this.notice,
      h('div', { class: 'bottom' }, this.news, this.pauseButton, head, small),
    );
    this.pauseButton.addEventListener('click', () => this.pause.toggle());
    this.fullButton.addEventListener('click', () => this.toggleFull());
    this.soundButton.addEventListener('click', () => this.chime.toggle());
    this.spokenButton.addEventListener('click', () => this.spoken.toggle());
    this.voiceButton.addEventListener('click', () => this.toggleVoice());
    this.muteButton.addEventListener('click', () => this.room.toggleMute());
    document.addEventListener('keydown', (event) => this.key(event));
  }

  start(): void {
    requestAnimationFrame(() => this.frame());
  }

  /** No key that also presses a button: what a press does is done once. */
  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    if (isComposing(event)) return;
    switch (event.key.toLowerCase()) {
      case 'p':
        this.pause.toggle();
        break;
      case 'f':
        this.toggleFull();
        break;
      case 'x':
        this.head.toggleStop();
        break;
      case 's':
        this.chime.toggle();
        break;
      case 'v':
        this.toggleVoice();
        break;
      case 'm':
        this.room.toggleMute();
        break;
    }
  }

  private toggleVoice(): void {
    if (this.room.state === 'off') void this.room.join();
    else this.room.leave();
  }

  private toggleFull(): void {
    if (document.fullscreenElement) void document.exitFullscreen();
    else document.documentElement.requestFullscreen().catch(() => undefined);
  }

  private frame(): void {
    requestAnimationFrame(() => this.frame());
    this.player.draw();
    this.watch.update();
    this.update();
  }

  private update(): void {
    const { session, player, pause } = this;
    const { link, pose, poseMs, sourceEnded } = session;
    const words = statusWords({ link, pose, poseMs, sourceEnded, nowMs: pageNowMs() });
    const { paused } = pause;
    const age = player.shown ? pageNowMs() - player.shown.drawnMs : 0;
    const stale = age > STALE_MS && !paused && !sourceEnded;
    // That all is well is no news: then there is nothing but the marks.
    const well = link.kind === 'live' && words.text === 'tracking good' && !stale;
    setClass(this.line, 'hidden', well);
    setText(this.mark, words.mark);
    setText(this.words, [words.text, words.advice].filter(Boolean).join(': '));
    setClass(this.line, 'warn', words.warn);
    setText(this.watchers, session.live ? watcherWords(session, this.room) : '');
    setText(this.pauseButton, paused ? '▶ Go on' : 'Ⅱ Pause picture');
    this.pauseButton.setAttribute('aria-pressed', String(paused));
    setText(this.pausedWords, paused ? pausedText(session) : '');
    setClass(this.element, 'paused', paused);
    const { newest } = this.watch;
    setText(this.news, newest?.text ?? '');
    setClass(this.news, 'lit', newest !== undefined && performance.now() - newest.atMs < NEWS_MS);
    this.updateSmall();
    this.head.update();
    this.record.update(performance.now());
    const problems = [pause, this.head, this.record, this.room, this.spoken].map(
      ({ problem: text }) => text,
    );
    const problem = problems.find((text) => text !== '');
    setText(this.notice, problem ?? noticeWords(player, stale ? age : 0));
    setClass(this.element, 'stale', stale);
    this.element.dataset['heard'] = this.room.figures;
    this.element.dataset['chimes'] = String(this.chime.count);
  }

  private updateSmall(): void {
    const { room, chime, spoken } = this;
    const open = room.state !== 'off';
    setText(this.voiceButton, open ? 'Leave voice' : 'Join voice');
    this.voiceButton.setAttribute('aria-pressed', String(open));
    setClass(this.muteButton, 'hidden', !room.hasMicrophone);
    setText(this.muteButton, room.muted ? 'Unmute' : 'Mute');
    this.muteButton.setAttribute('aria-pressed', String(room.muted));
    setText(this.soundButton, chime.muted ? 'Sound is off' : 'Sound is on');
    this.soundButton.setAttribute('aria-pressed', String(!chime.muted));
    setText(this.spokenButton, spoken.listening ? 'Listens for “pause”' : 'Pause by voice');
    this.spokenButton.setAttribute('aria-pressed', String(spoken.listening));
    setText(this.fullButton, document.fullscreenElement ? 'Leave full screen' : 'Full screen');
  }
}

function pausedText({ talk }: Session): string {
  const since = talk.pause ? ` since ${clockWords(talk.pause.sinceMs)}` : '';
  return `Picture paused${since}. Nobody sees the camera; the map stays live.`;
}

/** "Ann, Bea watch · Ann steers"; a name that is lit speaks. */
function watcherWords(session: Session, room: VoiceRoom): string {
  const { participants, gaze, participantId } = session;
  const others = participants.filter((each) => each.role !== 'wearer' && !isRecorder(each));
  const names = others.map((each) =>
    room.speaks(each.participantId) ? `🔊 ${each.name}` : each.name,
  );
  const watching =
    names.length === 0
      ? 'nobody watches'
      : `${names.join(', ')} ${names.length === 1 ? 'watches' : 'watch'}`;
  if (!hasHead(gaze)) return watching;
  if (gaze.paused) return `${watching} · head stopped`;
  if (!gaze.pilot) return watching;
  return `${watching} · ${gaze.pilot.participantId === participantId ? 'you steer' : `${gaze.pilot.name} steers`}`;
}

function noticeWords(player: Player, staleMs: number): string {
  if (player.unsupported) return `No video. ${player.unsupported}`;
  return staleMs > 0 ? `This picture is ${(staleMs / 1000).toFixed(0)} s old` : '';
}
