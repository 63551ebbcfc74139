import { CalibrationPhase, CalibrationWatch } from '../session/calibration';
import type { Session } from '../session/session';
import { arrowScale, drawCoverage, drawResiduals } from './calibrate_draw';
import { CalibrateForm } from './calibrate_form';
import { CalibrateResult } from './calibrate_result';
import { adviceWords, phaseWords, progressWords, rmsWords } from './calibrate_words';
import { h, setAttribute, setClass, setText } from './dom';

const SPEAK_MS = 4000; // the same advice is not said again before

/** The camera's calibration, while a target is shown to it. */
export class CalibrateApp {
  readonly element: HTMLElement;
  private readonly watch: CalibrationWatch;
  private readonly form = new CalibrateForm((target, lens) => void this.watch.start(target, lens));
  private readonly result = new CalibrateResult((form) => void this.download(form));
  private readonly state = h('span', { class: 'state' });
  private readonly picture = h('canvas', { role: 'img', 'aria-label': 'What the camera sees' });
  private readonly advice = h('p', { class: 'advice', role: 'status' });
  private readonly progress = h('progress', { 'aria-label': 'Views taken' });
  private readonly views = h('span', { class: 'number' });
  private readonly rms = h('span', { class: 'number' });
  private readonly problem = h('p', { class: 'doubt', role: 'alert' });
  private readonly finish = h('button', { type: 'button' }, 'Finish with these views');
  private readonly stop = h('button', { type: 'button' }, 'Stop');
  private readonly aloud = h('input', { type: 'checkbox' });
  private bitmap: ImageBitmap | undefined;
  private drawnFrame: bigint | undefined;
  private said = { words: '', ms: 0 };

  constructor(private readonly session: Session) {
    this.watch = new CalibrationWatch(session, () => this.show());
    this.finish.addEventListener('click', () => void this.watch.finish());
    this.stop.addEventListener('click', () => void this.watch.stop());
    this.result.save.addEventListener('click', () => void this.watch.save());
    this.element = h(
      'div',
      { class: 'calibrate-page' },
      h('header', {}, h('h1', {}, 'Calibrate the camera'), this.state),
      h(
        'main',
        {},
        h(
          'section',
          { class: 'look', 'aria-label': 'Live' },
          this.picture,
          this.advice,
          h('div', { class: 'progress' }, this.progress, this.views, this.rms),
          h('label', { class: 'aloud' }, this.aloud, 'Say the advice aloud'),
        ),
        h(
          'section',
          { class: 'side', 'aria-label': 'Target and result' },
          this.problem,
          this.form.element,
          h('div', { class: 'files' }, this.finish, this.stop),
          this.result.element,
        ),
      ),
    );
    window.addEventListener('resize', () => this.show());
  }

  start(): void {
    const leaving = new AbortController();
    window.addEventListener('pagehide', () => leaving.abort());
    void this.watch.run(leaving.signal);
    this.show();
  }

  private show(): void {
    const { now, fit, problem } = this.watch;
    const phase = now?.phase ?? CalibrationPhase.UNSPECIFIED;
    const running = phase === CalibrationPhase.SHOWING || phase === CalibrationPhase.FITTING;
    setText(this.state, this.session.live ? phaseWords(now) : 'no connection to the server');
    setText(this.advice, adviceWords(now));
    this.say(running ? adviceWords(now) : '');
    setText(this.problem, problem);
    setClass(this.form.element, 'hidden', running);
    setText(this.form.begin, phase === CalibrationPhase.IDLE ? 'Start' : 'Start anew');
    setClass(this.finish, 'hidden', phase !== CalibrationPhase.SHOWING || fit === undefined);
    setClass(this.stop, 'hidden', !running);
    setClass(this.progress, 'hidden', now === undefined || now.enoughViews === 0);
    if (now !== undefined && now.enoughViews > 0) {
      this.progress.max = now.enoughViews;
      this.progress.value = Math.min(now.views, now.enoughViews);
      setText(this.views, progressWords(now));
    }
    setText(this.rms, rmsWords(fit));
    this.result.show(fit, phase === CalibrationPhase.DONE);
    this.showSaving(now?.savedAs ?? '', fit?.doubt ?? '');
    this.draw();
    void this.decode();
  }

  private showSaving(savedAs: string, doubt: string): void {
    this.result.save.disabled = doubt !== '';
    const words = savedAs
      ? `Kept as ${savedAs} and used from the server's next start on.`
      : doubt
        ? 'Not kept: it is not to be believed yet.'
        : '';
    setText(this.result.saved, words);
  }

  private draw(): void {
    const { now, fit, picture } = this.watch;
    drawCoverage(this.picture, picture === undefined ? undefined : this.bitmap, picture, now);
    const seen = now?.counts.filter((count) => count > 0).length ?? 0;
    const of = now?.counts.length ?? 0;
    setAttribute(
      this.picture,
      'aria-label',
      of === 0 ? 'What the camera sees' : `The target was in ${seen} of ${of} parts of the picture`,
    );
    if (fit === undefined || picture === undefined) return;
    const size = { width: picture.widthPx, height: picture.heightPx };
    const scale = arrowScale(fit.residualsPx, size.width);
    drawResiduals(this.result.residuals, fit, size, scale);
    setAttribute(this.result.residuals, 'aria-label', `Residuals, ${rmsWords(fit)}`);
    setText(
      this.result.plotWords,
      `From each corner to where the lens has it, drawn ${scale} times as long`,
    );
  }

  /** The newest picture; one that came late is left out. */
  private async decode(): Promise<void> {
    const { picture } = this.watch;
    if (picture === undefined || picture.frameId === this.drawnFrame) return;
    this.drawnFrame = picture.frameId;
    const bitmap = await createImageBitmap(
      new Blob([new Uint8Array(picture.jpeg)], { type: 'image/jpeg' }),
    ).catch(() => undefined);
    if (bitmap === undefined || this.watch.picture !== picture) return;
    this.bitmap?.close();
    this.bitmap = bitmap;
    this.draw();
  }

  private say(words: string): void {
    if (!this.aloud.checked || !('speechSynthesis' in window) || words === '') return;
    const ms = performance.now();
    if (words === this.said.words || ms - this.said.ms < SPEAK_MS) return;
    this.said = { words, ms };
    window.speechSynthesis.cancel();
    window.speechSynthesis.speak(new SpeechSynthesisUtterance(words));
  }

  private async download(form: string): Promise<void> {
    const file = await this.watch.file(form);
    if (file === undefined) return;
    const url = URL.createObjectURL(new Blob([file.text], { type: 'application/yaml' }));
    const link = h('a', { href: url, download: file.fileName });
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  }
}
