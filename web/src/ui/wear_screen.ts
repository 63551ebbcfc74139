import type { Lens } from '../uplink/camera';
import { h, setClass, setText } from './dom';
import type { WearWords } from './wear_words';

export interface WearState {
  readonly words: WearWords;
  readonly started: boolean;
  readonly refused: boolean;
  readonly failure: string; // why there is no camera, with the remedy
  readonly paused: boolean;
  readonly watchers: string;
  readonly latency: string;
  readonly voice: { readonly open: boolean; readonly microphone: boolean; readonly muted: boolean };
  readonly news: string; // what was said or placed last
  readonly lit: boolean; // just now
}

/** What the phone's page consists of. */
export class WearScreen {
  readonly picture = h('canvas', { class: 'picture' });
  readonly start = h('button', { type: 'button', class: 'start' }, 'Start');
  readonly pause = h('button', { type: 'button', class: 'pause' });
  readonly voice = h('button', { type: 'button', class: 'voice' });
  readonly mute = h('button', { type: 'button', class: 'mute' });
  readonly lens = h('select', { 'aria-label': 'Lens' });
  readonly element: HTMLElement;
  private readonly line = h('p', { class: 'line', role: 'status' });
  private readonly watchers = h('p', { class: 'watchers' });
  private readonly failure = h('p', { class: 'failure', role: 'alert' });
  private readonly news = h('p', { class: 'news', role: 'status', dir: 'auto' });
  private readonly latency = h('p', { class: 'latency' });
  private readonly intro: HTMLElement;
  private readonly bar: HTMLElement;
  private readonly context = this.picture.getContext('2d', { alpha: false });

  constructor() {
    this.intro = h(
      'section',
      { class: 'intro' },
      h('h1', {}, 'This phone is the camera'),
      h(
        'p',
        {},
        'Experts who were invited see what its camera sees, and place marks in it that you see here. Nothing is heard before you join the voice.',
      ),
      h('p', {}, 'Tap Start and allow the camera. The screen stays on until you leave this page.'),
      this.failure,
      this.start,
    );
    this.bar = h(
      'div',
      { class: 'bar' },
      this.latency,
      this.news,
      h('div', { class: 'row' }, this.voice, this.mute),
      h('div', { class: 'row' }, this.lens, this.pause),
    );
    this.element = h(
      'div',
      { class: 'wear-view' },
      this.picture,
      h('div', { class: 'top' }, this.line, this.watchers),
      this.intro,
      this.bar,
    );
  }

  setLenses(lenses: readonly Lens[], current: string): void {
    this.lens.replaceChildren(
      ...lenses.map(({ deviceId, label }) => {
        const option = h('option', { value: deviceId }, label);
        option.selected = label === current;
        return option;
      }),
    );
  }

  /** Shows a picture as large as there is room; returns where it lies, as Painter.begin takes it. */
  show(from: HTMLCanvasElement): { left: number; top: number; scale: number } {
    const { picture, element } = this;
    const { width, height } = from;
    if (picture.width !== width) picture.width = width;
    if (picture.height !== height) picture.height = height;
    this.context?.drawImage(from, 0, 0);
    const { clientWidth, clientHeight } = element;
    const scale = Math.min(clientWidth / width, clientHeight / height);
    const left = (clientWidth - width * scale) / 2;
    const top = (clientHeight - height * scale) / 2;
    picture.style.transform = `translate(${left}px, ${top}px) scale(${scale})`;
    return { left, top, scale };
  }

  update(state: WearState): void {
    const { words, started, refused, failure, paused, watchers, latency, voice } = state;
    setText(this.line, words.text);
    setClass(this.line, 'warn', words.warn);
    setText(this.watchers, watchers);
    setText(this.failure, failure);
    setText(this.start, failure ? 'Start again' : 'Start');
    setClass(this.intro, 'hidden', started || refused);
    setClass(this.bar, 'hidden', !started);
    setClass(this.lens, 'hidden', this.lens.options.length < 2);
    setText(this.pause, paused ? '▶ Go on' : 'Ⅱ Pause picture');
    setText(this.latency, latency);
    setText(this.news, state.news);
    setClass(this.news, 'lit', state.lit);
    setText(this.voice, voice.open ? 'Leave voice' : 'Join voice');
    this.voice.setAttribute('aria-pressed', String(voice.open));
    setClass(this.mute, 'hidden', !voice.microphone);
    setText(this.mute, voice.muted ? 'Unmute' : 'Mute');
    this.mute.setAttribute('aria-pressed', String(voice.muted));
    setClass(this.element, 'stale', refused);
    setClass(this.element, 'paused', paused);
  }
}
