import { pageNowMs } from '../session/clock';
import type { LatencyMeter } from '../session/latency';
import { cleanName, keepName, MAX_NAME_BYTES, recallName } from '../session/name';
import type { Session } from '../session/session';
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
  private readonly presence = h('span', { class: 'presence' });

  constructor(helpButton: HTMLElement, rename: (name: string) => void) {
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
      nameField(rename),
      helpButton,
    );
  }

  update(session: Session, player: Player, meter: LatencyMeter): void {
    const nowMs = pageNowMs();
    const { link, pose, poseMs, sourceEnded, participants, joined } = session;
    const words = statusWords({ link, pose, sourceEnded, nowMs, poseMs });
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
    setText(this.presence, session.live ? presenceWords(participants) : '');
  }
}

/** Who I am, as the others see it. */
function nameField(rename: (name: string) => void): HTMLElement {
  const input = h('input', {
    class: 'name',
    type: 'text',
    autocomplete: 'nickname',
    'aria-label': 'Your name',
    title:
      'Your name, as the others see it. A new one begins a new session: what you did before it can no longer be undone.',
  });
  let name = recallName(location.search, storage());
  input.value = name;
  // Said, and left as it is: nobody is called half a name without knowing it.
  input.addEventListener('input', () => {
    const left = MAX_NAME_BYTES - bytesOf(input.value.trim());
    input.setCustomValidity(left < 0 ? `${-left} bytes too long` : '');
    input.reportValidity();
  });
  input.addEventListener('change', () => {
    if (!input.checkValidity()) return;
    name = cleanName(input.value) || name;
    input.value = name;
    keepName(name, storage());
    rename(name);
  });
  input.addEventListener('keydown', ({ key }) => {
    if (key === 'Escape') {
      input.value = name;
      input.setCustomValidity('');
    }
    if (key === 'Enter' || key === 'Escape') input.blur();
  });
  return input;
}
