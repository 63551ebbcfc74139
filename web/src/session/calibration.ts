import type {
  Calibration,
  CalibrationFit,
  CalibrationPicture,
} from '../gen/saccade/v1/calibration_pb';
import { plainWords } from '../transport/errors';
import type { Session } from './session';
import { sleep } from './sleep';

export { CalibrationPhase } from '../gen/saccade/v1/calibration_pb';
export type { Calibration, CalibrationFit, CalibrationPicture };

const LOOK_MS = 150; // the server looks at some pictures a second
const IDLE_MS = 600;

/** What the server tells of the camera's calibration: asked for again and again. */
export class CalibrationWatch {
  now: Calibration | undefined;
  fit: CalibrationFit | undefined;
  picture: CalibrationPicture | undefined;
  problem = ''; // why nothing is told, or what was asked for was not done

  constructor(
    private readonly session: Session,
    private readonly changed: () => void,
  ) {}

  async run(signal: AbortSignal): Promise<void> {
    while (!signal.aborted) {
      if (this.session.live) await this.ask(signal);
      await sleep(this.picture === undefined ? IDLE_MS : LOOK_MS, signal);
    }
  }

  start(target: string, lens: string): Promise<boolean> {
    return this.call('startCalibration', { target, lens });
  }
  finish(): Promise<boolean> {
    return this.call('finishCalibration', {});
  }
  stop(): Promise<boolean> {
    return this.call('stopCalibration', {});
  }
  save(): Promise<boolean> {
    return this.call('saveCalibration', {});
  }

  /** The result as a file of that form; undefined: `problem` says why. */
  async file(form: string): Promise<{ fileName: string; text: string } | undefined> {
    const { clients, sessionId } = this.session;
    try {
      const request = { sessionId, form };
      const told = await clients.calibration.getCalibrationFile(request, { timeoutMs: 10_000 });
      this.settle('');
      return told;
    } catch (error) {
      this.settle(plainWords(error));
      return undefined;
    }
  }

  private async call(
    method: 'startCalibration' | 'finishCalibration' | 'stopCalibration' | 'saveCalibration',
    request: { target?: string; lens?: string },
  ): Promise<boolean> {
    const { clients, sessionId } = this.session;
    try {
      await clients.calibration[method]({ ...request, sessionId }, { timeoutMs: 20_000 });
      this.settle('');
      return true;
    } catch (error) {
      this.settle(plainWords(error));
      return false;
    }
  }

  private settle(problem: string): void {
    this.problem = problem;
    this.changed();
  }

  private async ask(signal: AbortSignal): Promise<void> {
    const { clients, sessionId } = this.session;
    const request = {
      sessionId,
      knownFitRevision: this.fit === undefined ? 0n : (this.now?.fitRevision ?? 0n),
      knownFrameId: this.picture?.frameId ?? 0n,
    };
    try {
      const options = { signal, timeoutMs: 5000 };
      const { calibration } = await clients.calibration.getCalibration(request, options);
      if (calibration !== undefined) this.take(calibration);
    } catch (error) {
      if (!signal.aborted) this.settle(plainWords(error));
    }
  }

  private take(told: Calibration): void {
    const anew = told.target !== this.now?.target || told.views < this.now.views;
    if (anew || told.fitRevision === 0n) this.fit = undefined;
    if (told.fit !== undefined) this.fit = told.fit;
    if (anew || told.views === 0) this.picture = undefined;
    if (told.picture !== undefined) this.picture = told.picture;
    this.now = told;
    this.changed();
  }
}
