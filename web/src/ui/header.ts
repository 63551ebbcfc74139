import { pageNowMs } from '../session/clock';
import type { LatencyMeter } from '../session/latency';
import { cleanName, keepName, MAX_NAME_BYTES, recallName } from '../session/name';
import { isRecorder } from '../session/recording';
import type { Session } from '../session/session';
import type { Participant } from '../session/types';
import { colourOf } from '../scene/strokes';
import { bytesOf } from '../tools/note_text';
import { h, setClass, setText, storage } from './dom';
import type { Player } from './player';
import { presenceWords, statusWords } from './words';

/** One line: what is watched, how tracking is and what to do about it, rates, who is here. */
export class Header {
  readonly element: HTMLElement;
  private readonly source = h('span', { class: 'source' });
  private readonly mark = h('span', { class: 'mark', 'aria-hidden': 'true' });
  private readonly status = h('strong', {});
  private readonly advice = h('span', { class: 'advice' });
  private readonly statusBox = h(
    'span',
    { class: 'status', role: 'status' },
    this.mark,
    this.status,
    this.advice,
  );
  private readonly rate = h('span', { class: 'number rate', title: 'pictures shown a second' });
  private readonly latency = h('span', {
    class: 'number',
    title: 'from the middle of the exposure to this screen, median of the last 90 pictures',
  });
  private readonly people = h('span', { class: 'people' });
  private readonly count = h('span', { class: 'count' });
  private readonly presence = h('span', { class: 'presence' }, this.people, this.count);
  private readonly name: NameField;
  private shownPeople = '';

  constructor(helpButton: HTMLElement, rename: (name: string) => void) {
    this.name = new NameField(rename);
    this.element = h(
      'header',
      {},
      h('h1', {}, 'Saccade'),
      this.source,
      this.statusBox,
      h('span', { class: 'space' }),
      this.rate,
      this.latency,
      this.presence,
      this.name.input,
      helpButton,
    );
  }

  update(session: Session, player: Player, meter: LatencyMeter): void {
    const nowMs = pageNowMs();
    const { link, pose, poseMs, sourceEnded, participants, joined } = session;
    const paused = session.talk.pause !== undefined;
    const words = statusWords({ link, pose, sourceEnded, nowMs, poseMs, paused });
    setText(this.source, joined?.source ?? '');
    this.source.title = joined?.source ?? '';
    setText(this.mark, words.mark);
    setText(this.status, words.text);
    setText(this.advice, words.advice);
    this.advice.title = words.advice;
    setClass(this.statusBox, 'warn', words.warn);
    const fps = player.rate.rate(nowMs);
    const total = meter.get('total')?.p50;
    const live = session.live && fps > 0;
    setText(this.rate, live ? `${fps.toFixed(0)} fps` : '– fps');
    setText(this.latency, live && total !== undefined ? `${total.toFixed(0)} ms` : '– ms');
    this.showPeople(session.live ? participants : []);
  }

  /** By name where there is room, else how many; each with the colour of what is theirs. */
  private showPeople(participants: readonly Participant[]): void {
    const key = JSON.stringify(participants);
    if (key === this.shownPeople) return;
    this.shownPeople = key;
    setText(this.count, presenceWords(participants));
    this.presence.title = participants.map(({ name, role }) => `${name}, ${role}`).join('\n');
    this.people.replaceChildren(
      ...participants.slice(0, MOST_PEOPLE).map((each) => {
        const { name, role, colorRgba } = each;
        const dot = h('span', { class: 'person', 'aria-hidden': 'true' });
        dot.style.setProperty('--person', colourOf({ colorRgba: colorRgba || 0xa9aeb4ff }));
        const titled = role === 'expert' ? name : `${name} (${role})`;
        const words = isRecorder(each) ? 'recorded' : titled;
        return h('span', { class: 'participant' }, dot, h('span', { class: 'who' }, words));
      }),
    );
  }

  /** A name that was given elsewhere. */
  setName(name: string): void {
    this.name.set(name);
  }
}

const MOST_PEOPLE = 6;

/** Who I am, as the others see it. */
class NameField {
  readonly input = h('input', {
    ...{ class: 'name', type: 'text', autocomplete: 'nickname', 'aria-label': 'Your name' },
    title: 'Your name, as the others see it. What you have done stays yours under a new one.',
  });
  private name = recallName(location.search, storage());

  constructor(rename: (name: string) => void) {
    const { input } = this;
    input.value = this.name;
    // Said, and left as it is: nobody is called half a name without knowing it.
    input.addEventListener('input', () => {
      const left = MAX_NAME_BYTES - bytesOf(input.value.trim());
      input.setCustomValidity(left < 0 ? `${-left} bytes too long` : '');
      input.reportValidity();
    });
    input.addEventListener('change', () => {
      if (!input.checkValidity()) return;
      this.set(cleanName(input.value) || this.name);
      keepName(this.name, storage());
      rename(this.name);
    });
    input.addEventListener('keydown', ({ key }) => {
      if (key === 'Escape') {
        input.value = this.name;
        input.setCustomValidity('');
      }
      if (key === 'Enter' || key === 'Escape') input.blur();
    });
  }

  set(name: string): void {
    this.name = this.input.value = name;
  }
}
