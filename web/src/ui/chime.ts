import { storage } from './dom';

const MUTED = 'saccade.chimeMuted';
const TONES_HZ = [880, 1175]; // a rising fourth: heard over a machine, and no alarm
const TONE_S = 0.11;
const VOLUME = 0.25;

/** A short sound that something came; can be muted, and that is kept. */
export class Chime {
  private context: AudioContext | undefined;
  muted = storage().getItem(MUTED) === 'yes';
  /** How often it sounded, for tests. */
  count = 0;

  /** Browsers play sound only after somebody has touched the page. */
  constructor() {
    for (const event of ['pointerdown', 'keydown'] as const) {
      document.addEventListener(event, () => this.unlock(), { once: true, capture: true });
    }
  }

  toggle(): void {
    this.muted = !this.muted;
    try {
      storage().setItem(MUTED, this.muted ? 'yes' : 'no');
    } catch {
      // Full: then it is as it was after a reload.
    }
  }

  play(): void {
    const { context } = this;
    if (this.muted || !context || context.state !== 'running') return;
    ++this.count;
    TONES_HZ.forEach((frequency, i) => {
      const begin = context.currentTime + 0.02 + i * TONE_S;
      const gain = new GainNode(context, { gain: 0 });
      gain.gain.setValueAtTime(0, begin);
      gain.gain.linearRampToValueAtTime(VOLUME, begin + 0.01);
      gain.gain.exponentialRampToValueAtTime(0.001, begin + TONE_S);
      const tone = new OscillatorNode(context, { frequency });
      tone.connect(gain).connect(context.destination);
      tone.start(begin);
      tone.stop(begin + TONE_S);
    });
  }

  private unlock(): void {
    if (this.context || typeof AudioContext === 'undefined') return;
    this.context = new AudioContext();
    void this.context.resume();
  }
}
