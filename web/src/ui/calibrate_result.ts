import type { CalibrationFit } from '../session/calibration';
import { valueWords } from './calibrate_words';
import { h, setClass, setText } from './dom';

const FORMS = [
  ['saccade', 'camera.yaml'],
  ['kalibr', 'Kalibr'],
  ['ros', 'ROS'],
  ['opencv', 'OpenCV'],
] as const;

/** What was found: parameters with sigmas, views, files. */
export class CalibrateResult {
  readonly element: HTMLElement;
  readonly residuals = h('canvas', { role: 'img' });
  readonly plotWords = h('p', { class: 'dim' });
  private readonly title = h('h2');
  private readonly doubt = h('p', { class: 'doubt', role: 'status' });
  private readonly parameters = h('tbody');
  private readonly views = h('p', { class: 'dim number' });
  private readonly files = h('div', { class: 'files' });
  readonly save = h('button', { type: 'button', class: 'main' }, 'Keep it for this camera');
  readonly saved = h('p', { role: 'status' });
  private shown: CalibrationFit | undefined;

  constructor(download: (form: string) => void) {
    for (const [form, name] of FORMS) {
      const button = h('button', { type: 'button' }, name);
      button.addEventListener('click', () => download(form));
      this.files.append(button);
    }
    this.element = h(
      'section',
      { class: 'result', 'aria-label': 'What was found' },
      this.title,
      this.doubt,
      h(
        'table',
        { class: 'number' },
        h(
          'thead',
          {},
          h(
            'tr',
            {},
            ...['Parameter', 'Value', 'Sigma'].map((name) => h('th', { scope: 'col' }, name)),
          ),
        ),
        this.parameters,
      ),
      this.views,
      this.residuals,
      this.plotWords,
      h('h3', {}, 'Download'),
      this.files,
      this.save,
      this.saved,
    );
  }

  show(fit: CalibrationFit | undefined, done: boolean): void {
    setClass(this.element, 'hidden', fit === undefined);
    setClass(this.files, 'hidden', !done);
    const heading = this.files.previousElementSibling;
    if (heading instanceof HTMLElement) setClass(heading, 'hidden', !done);
    setClass(this.save, 'hidden', !done);
    if (fit === undefined) return;
    setText(this.title, done ? `Lens: ${fit.model}` : `So far: ${fit.model}`);
    setText(this.doubt, done ? fit.doubt : '');
    if (fit === this.shown) return;
    this.shown = fit;
    this.parameters.replaceChildren(
      ...fit.parameters.map(({ name, value, sigma }) => {
        const words = valueWords(value, sigma);
        return h(
          'tr',
          {},
          h('th', { scope: 'row' }, name),
          h('td', {}, words.value),
          h('td', {}, `± ${words.sigma}`),
        );
      }),
    );
    setText(this.views, viewWords(fit));
  }
}

function viewWords({ rmsPx, heldOutRmsPx, views }: CalibrationFit): string {
  const rejected = views.filter((view) => view.rejected).length;
  const held = views.filter((view) => view.heldOut).length;
  const worst = Math.max(0, ...views.filter((view) => !view.rejected).map((view) => view.rmsPx));
  return [
    `RMS ${rmsPx.toFixed(3)} px over ${views.length - rejected - held} views, worst ${worst.toFixed(2)} px`,
    ...(held > 0 ? [`${held} held out: ${heldOutRmsPx.toFixed(3)} px`] : []),
    ...(rejected > 0 ? [`${rejected} rejected`] : []),
  ].join('; ');
}
