import type { Session } from '../session/session';
import type { VoiceRoom } from '../talk/voice_room';
import { h, setClass, setText } from './dom';

/** Joins the voices, mutes, push to talk, and who is there and who speaks. */
export class VoiceBar {
  readonly element: HTMLElement;
  private readonly join = h('button', { type: 'button', 'aria-keyshortcuts': '8' });
  private readonly mute = h('button', { type: 'button', 'aria-keyshortcuts': '7' });
  private readonly hold = h('button', { type: 'button' }, 'Push to talk');
  private readonly words = h('p', { class: 'voice-words' });
  private readonly problem = h('p', { class: 'why', role: 'alert' });
  private readonly people = h('ul', { class: 'people', 'aria-label': 'Who hears' });
  private shown = '';

  constructor(
    private readonly session: Session,
    private readonly room: VoiceRoom,
  ) {
    this.join.addEventListener('click', () => this.toggleJoin());
    this.mute.addEventListener('click', () => room.toggleMute());
    this.hold.addEventListener('click', () => room.togglePushToTalk());
    this.hold.title = 'Heard only while Space is held';
    this.element = h(
      'div',
      { class: 'voice' },
      h('div', { class: 'voice-row' }, this.join, this.mute, this.hold),
      this.words,
      this.problem,
      this.people,
    );
  }

  toggleJoin(): void {
    if (this.room.state === 'off') void this.room.join();
    else this.room.leave();
  }

  update(): void {
    const { room } = this;
    const on = room.state !== 'off';
    setText(this.join, on ? 'Leave voice' : 'Join voice');
    this.join.title = on ? 'Leave the voices (8)' : 'Hear the others, and be heard (8)';
    setClass(this.mute, 'hidden', !room.hasMicrophone);
    setClass(this.hold, 'hidden', !room.hasMicrophone);
    setText(this.mute, room.muted ? 'Unmute' : 'Mute');
    this.mute.title = room.muted ? 'Be heard again (7)' : 'Not heard until unmuted (7)';
    this.mute.setAttribute('aria-pressed', String(room.muted));
    this.hold.setAttribute('aria-pressed', String(room.pushToTalk));
    setClass(this.mute, 'on', room.muted);
    setClass(this.hold, 'on', room.pushToTalk);
    setText(this.words, stateWords(room));
    setText(this.problem, room.problem);
    this.element.dataset['heard'] = room.figures;
    this.updatePeople();
  }

  private updatePeople(): void {
    const { session, room } = this;
    const there = session.participants.filter(({ listens }) => listens === true);
    const rows = there.map(({ participantId, name }) => ({
      name: participantId === session.participantId ? `${name} (you)` : name,
      speaks: room.speaks(participantId),
    }));
    const shown = JSON.stringify(rows);
    if (shown === this.shown) return;
    this.shown = shown;
    this.people.replaceChildren(
      ...rows.map(({ name, speaks }) => {
        const words = speaks ? `${name} speaks` : name;
        return h('li', { class: speaks ? 'speaks' : '' }, h('span', { class: 'dot' }), words);
      }),
    );
  }
}

function stateWords(room: VoiceRoom): string {
  if (room.state === 'off') return '';
  if (room.state === 'opening') return 'opening the sound';
  if (!room.hasMicrophone) return 'You hear the others.';
  if (room.muted) return 'You are muted.';
  if (!room.pushToTalk) return 'You are heard.';
  return room.open ? 'You are heard while you hold.' : 'Hold Space to be heard.';
}
