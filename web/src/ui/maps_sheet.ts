import { type KeptMap, Maps } from '../session/maps';
import type { Session } from '../session/session';
import { bytesOf } from '../tools/note_text';
import { reasonOf } from './attempt';
import { h, setText } from './dom';
import { whyNotEdit } from './rights';
import { counted } from './words';

const MAX_NAME_BYTES = 200; // map.proto

export const mapName = ({ name }: KeptMap): string => name || 'kept by itself';

/** When, how large, and whether sizes in it are metres. */
export function mapWords({ savedMs, landmarks, bytes, metric }: KeptMap, locale?: string): string {
  const when = new Date(savedMs).toLocaleString(locale, {
    dateStyle: 'medium',
    timeStyle: 'short',
  });
  const size = `${(bytes / 1e6).toFixed(1)} MB`;
  const scale = metric ? 'in metres' : 'scale unknown';
  return [when, size, counted(landmarks, 'landmark'), scale].join(' · ');
}

/** Why a map cannot be kept under this name; empty: it can. */
export function problemOfName(name: string): string {
  if (!name) return 'Give it a name.';
  const over = bytesOf(name) - MAX_NAME_BYTES;
  return over > 0 ? `${over} bytes too long: shorten it.` : '';
}

type Act = 'load' | 'delete';
const WORDS = {
  load: {
    ask: (name: string) =>
      `Look for “${name}”? The map of now is kept and set aside; its marks are paused.`,
    yes: 'Look for it',
    done: (name: string) => `“${name}” is looked for in the pictures that come.`,
  },
  delete: {
    ask: (name: string) => `Delete “${name}” from the server’s disk? It cannot be had back.`,
    yes: 'Delete it',
    done: (name: string) => `“${name}” is deleted.`,
  },
} as const;

/** The maps that the server keeps: seen by everybody; saved, loaded, deleted by who may change something. */
export class MapsSheet {
  readonly button = h('button', { type: 'button', class: 'maps' }, 'Maps');
  readonly dialog: HTMLDialogElement;
  private readonly maps: Maps;
  private readonly list = h('ul', { class: 'kept-maps' });
  private readonly name = h('input', { id: 'map-name', type: 'text', dir: 'auto' });
  private readonly save = h('button', { type: 'submit', class: 'main' }, 'Save');
  private readonly news = h('p', { class: 'news', role: 'status' });
  private readonly problem = h('p', { class: 'problem', role: 'alert' });

  constructor(private readonly session: Session) {
    this.maps = new Maps(session);
    this.name.autocomplete = 'off';
    const form = h(
      'form',
      { method: 'dialog' },
      h('label', { for: 'map-name' }, 'Keep a copy of the map as it is now, under the name'),
      h('div', { class: 'line' }, this.name, this.save),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.keep();
    });
    const close = h('button', { type: 'button' }, 'Close (Esc)');
    close.addEventListener('click', () => this.dialog.close());
    this.dialog = h(
      'dialog',
      { class: 'asks', 'aria-labelledby': 'maps-heading' },
      h('h2', { id: 'maps-heading' }, 'Maps on the server'),
      this.list,
      form,
      this.news,
      this.problem,
      h('div', { class: 'buttons' }, close),
    );
    this.button.addEventListener('click', () => this.open());
  }

  open(): void {
    const why = whyNotEdit(this.session);
    this.name.disabled = this.save.disabled = why !== undefined;
    setText(this.news, why ?? '');
    setText(this.problem, '');
    this.dialog.showModal();
    void this.show();
  }

  private async show(): Promise<void> {
    try {
      const all = await this.maps.list();
      this.list.replaceChildren(...all.map((map) => this.row(map)));
      if (all.length === 0) this.list.append(h('li', {}, 'None yet.'));
    } catch (error) {
      this.list.replaceChildren();
      setText(this.problem, `Not listed: ${reasonOf(error)}.`);
    }
  }

  private row(map: KeptMap): HTMLElement {
    const row = h('li', { 'data-map': map.id });
    const acts = h('span', { class: 'acts' });
    if (whyNotEdit(this.session) === undefined) {
      for (const [act, text] of [
        ['load', 'Load'],
        ['delete', 'Delete'],
      ] as const) {
        const label = { type: 'button', 'aria-label': `${text} ${mapName(map)}` };
        const button = h('button', label, text);
        button.addEventListener('click', () => this.ask(row, map, act));
        acts.append(button);
      }
    }
    const what = h('span', { class: 'what' }, h('strong', { dir: 'auto' }, mapName(map)));
    what.append(h('span', {}, mapWords(map)));
    row.append(what, acts);
    return row;
  }

  /** In the row itself, in place of its buttons. */
  private ask(row: HTMLElement, map: KeptMap, act: Act): void {
    const yes = h('button', { type: 'button', class: 'main' }, WORDS[act].yes);
    const no = h('button', { type: 'button' }, 'Leave it');
    const words = WORDS[act].ask(mapName(map));
    const question = h('div', { class: 'confirms', role: 'group', 'aria-label': words });
    question.append(h('p', {}, words), yes, no);
    no.addEventListener('click', () => {
      const before = this.row(map);
      row.replaceWith(before);
      before.querySelector('button')?.focus();
    });
    yes.addEventListener('click', () => {
      yes.disabled = no.disabled = true;
      void this.run(
        () => (act === 'load' ? this.maps.load(map.id) : this.maps.remove(map.id)),
        WORDS[act].done(mapName(map)),
      );
    });
    row.replaceChildren(question);
    no.focus();
  }

  private async keep(): Promise<void> {
    const name = this.name.value.trim();
    setText(this.problem, problemOfName(name));
    if (problemOfName(name)) return;
    this.save.disabled = true;
    await this.run(() => this.maps.save(name), `“${name}” is kept.`);
    this.save.disabled = false;
  }

  private async run(act: () => Promise<void>, done: string): Promise<void> {
    setText(this.news, '');
    setText(this.problem, '');
    try {
      await act();
      setText(this.news, done);
    } catch (error) {
      setText(this.problem, `Not done: ${reasonOf(error)}.`);
    }
    await this.show();
  }
}
