import { isComposing, isTextField } from './dom';
import type { TalkPanel } from './talk_panel';

export const TALK_KEYS = [
  { shown: '9', label: 'Message', hint: 'write a message to everybody there' },
  { shown: '8', label: 'Voice', hint: 'join the voices, or leave them' },
  { shown: '7', label: 'Mute', hint: 'not heard; again: heard' },
  { shown: 'Space', label: 'Talk', hint: 'with push to talk: heard while it is held' },
] as const;

/** True where Space is not pressing or typing something. */
const isFree = (target: EventTarget | null): boolean =>
  !(target instanceof HTMLButtonElement) && !isTextField(target);

/** What talks by key. */
export function handleTalkKeys(panel: TalkPanel, dialog: HTMLDialogElement): void {
  const { room } = panel;
  document.addEventListener('keydown', (event) => {
    if (isTextField(event.target) || isComposing(event) || dialog.open) return;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === ' ' && room.pushToTalk && isFree(event.target)) {
      event.preventDefault();
      room.press(true);
    }
    if (event.repeat) return;
    if (event.key === '9') {
      event.preventDefault(); // or it would be the first letter
      panel.write();
    } else if (event.key === '8') panel.voice.toggleJoin();
    else if (event.key === '7' && room.hasMicrophone) room.toggleMute();
  });
  document.addEventListener('keyup', ({ key }) => {
    if (key === ' ') room.press(false);
  });
  window.addEventListener('blur', () => room.press(false));
}
