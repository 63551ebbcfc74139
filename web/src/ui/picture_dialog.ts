import { bytesOf, cleanText, MAX_TEXT_BYTES } from '../tools/note_text';
import { reasonOf } from './attempt';
import { h, setClass, setText } from './dom';
import { type FittedPicture, fitPicture, openPicture, type PageSource } from './picture_file';

export interface ChosenPicture {
  readonly text: string;
  readonly sizeM: number;
  readonly picture: FittedPicture;
}

const DEFAULT_CM = 20;
const MOST_CM = 1000; // annotation.proto

/** Chooses a picture, or a page of a PDF, how wide it is to be, and what stands above it. */
export class PictureDialog {
  readonly dialog: HTMLDialogElement;
  private readonly file = h('input', {
    id: 'picture-file',
    type: 'file',
    accept: 'image/png,image/jpeg,image/webp,application/pdf,.pdf',
  });
  private readonly page = h('input', { id: 'picture-page', type: 'number', min: '1', value: '1' });
  private readonly pages = h('span', { class: 'pages' });
  private readonly pageRow = h(
    'div',
    { class: 'hidden page-row' },
    h('label', { for: 'picture-page' }, 'Page'),
    h('div', { class: 'line' }, this.page, this.pages),
  );
  private readonly width = h('input', {
    ...{ id: 'picture-width', type: 'number', min: '1' },
    max: String(MOST_CM),
  });
  private readonly text = h('input', {
    id: 'picture-text',
    type: 'text',
    dir: 'auto',
    autocomplete: 'off',
  });
  private readonly preview = h('div', { class: 'preview' });
  private readonly problem = h('p', { class: 'problem', role: 'alert' });
  private readonly news = h('p', { class: 'news', role: 'status' });
  private readonly place = h('button', { type: 'submit', class: 'main' }, 'Place it (Enter)');
  private source: PageSource | undefined;
  private fitted: FittedPicture | undefined;
  private opened = 0; // which of the files and pages that were chosen counts: the last
  private keep: (() => void) | undefined;

  constructor() {
    const cancel = h('button', { type: 'button' }, 'Cancel (Esc)');
    cancel.addEventListener('click', () => this.dialog.close());
    const form = h(
      'form',
      { method: 'dialog' },
      h('label', { for: 'picture-file' }, 'Picture or PDF'),
      this.file,
      this.pageRow,
      this.preview,
      this.news,
      h('label', { for: 'picture-width' }, 'Width in centimetres'),
      this.width,
      h('label', { for: 'picture-text' }, 'Words above it, if any'),
      this.text,
      this.problem,
      h('div', { class: 'buttons' }, this.place, cancel),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.keep?.();
    });
    this.file.addEventListener('change', () => {
      const [file] = this.file.files ?? [];
      if (file) void this.open(file);
    });
    this.page.addEventListener('change', () => void this.show(Number(this.page.value)));
    this.dialog = h(
      'dialog',
      { 'aria-labelledby': 'picture-heading', class: 'asks' },
      h('h2', { id: 'picture-heading' }, 'Picture'),
      form,
    );
    this.dialog.addEventListener('close', () => this.source?.close());
  }

  /** Resolves once it is closed; `place` is tried until it is kept or given up. */
  ask(file: File | undefined, place: (chosen: ChosenPicture) => Promise<void>): Promise<void> {
    this.forget();
    this.file.value = this.text.value = '';
    this.width.value = String(DEFAULT_CM);
    this.dialog.showModal();
    this.file.focus();
    this.keep = () => void this.send(place);
    if (file) void this.open(file);
    return new Promise((resolve) =>
      this.dialog.addEventListener('close', () => resolve(), { once: true }),
    );
  }

  private forget(): void {
    ++this.opened;
    this.source?.close();
    this.source = this.fitted = undefined;
    this.preview.replaceChildren();
    this.place.disabled = true;
    for (const words of [this.problem, this.news]) setText(words, '');
    setClass(this.pageRow, 'hidden', true);
  }

  private async open(file: File): Promise<void> {
    this.forget();
    const mine = this.opened;
    setText(this.news, `Opening ${file.name}`);
    try {
      const source = await openPicture(file);
      if (mine !== this.opened) {
        source.close();
        return;
      }
      this.source = source;
      const several = source.pages > 1;
      setClass(this.pageRow, 'hidden', !several);
      this.page.max = String(source.pages);
      this.page.value = '1';
      setText(this.pages, `of ${source.pages}`);
      await this.show(1);
    } catch (error) {
      if (mine === this.opened) this.fail(error);
    }
  }

  private async show(number: number): Promise<void> {
    const { source } = this;
    if (!source) return;
    const page = Math.min(Math.max(Math.round(number) || 1, 1), source.pages);
    this.page.value = String(page);
    const mine = ++this.opened;
    this.place.disabled = true;
    setText(this.news, 'Drawing it');
    try {
      const canvas = await source.draw(page);
      const fitted = await fitPicture(canvas);
      if (mine !== this.opened) return;
      this.fitted = fitted;
      canvas.setAttribute('role', 'img');
      canvas.setAttribute('aria-label', source.pages > 1 ? `Page ${page}` : 'The picture');
      this.preview.replaceChildren(canvas);
      const size = (fitted.bytes.length / 1024).toFixed(0);
      setText(this.news, `${fitted.width} × ${fitted.height} pixels, ${size} KiB`);
      this.place.disabled = false;
    } catch (error) {
      if (mine === this.opened) this.fail(error);
    }
  }

  private fail(error: unknown): void {
    setText(this.news, '');
    const reason = error instanceof Error ? error.message : String(error);
    setText(this.problem, `Not opened: ${reason}. Choose another one.`);
  }

  private async send(place: (chosen: ChosenPicture) => Promise<void>): Promise<void> {
    const { fitted: picture } = this;
    const text = cleanText(this.text.value);
    const widthCm = Number(this.width.value);
    let problem = '';
    if (!picture) problem = 'Choose a picture first.';
    else if (!(widthCm >= 1 && widthCm <= MOST_CM)) problem = `Width: 1 to ${MOST_CM} cm.`;
    else if (bytesOf(text) > MAX_TEXT_BYTES) problem = 'The words are too long: shorten them.';
    setText(this.problem, problem);
    if (problem || !picture) return;
    this.keep = undefined; // once
    this.place.disabled = true;
    setText(this.news, 'Sending it');
    try {
      await place({ text, sizeM: widthCm / 100, picture });
      this.dialog.close();
    } catch (error) {
      setText(this.news, '');
      setText(this.problem, `Not placed: ${reasonOf(error)}. Try again.`);
      this.place.disabled = false;
      this.keep = () => void this.send(place);
    }
  }
}
