/** What of SpeechRecognition is used here; TypeScript's list of the browser lacks it. */
interface Recognition {
  continuous: boolean;
  interimResults: boolean;
  lang: string;
  onresult: ((event: { results: ArrayLike<ArrayLike<{ transcript: string }>> }) => void) | null;
  onend: (() => void) | null;
  onerror: ((event: { error: string }) => void) | null;
  start(): void;
  abort(): void;
}

type Order = 'pause' | 'go on';

/** What was ordered, if the last words are an order: "pause picture", "go on". */
export function orderIn(transcript: string): Order | undefined {
  const words = transcript.toLowerCase().replace(/[^a-z ]/g, '');
  const pause = Math.max(words.lastIndexOf('pause'), words.lastIndexOf('stop picture'));
  const goOn = Math.max(words.lastIndexOf('go on'), words.lastIndexOf('show picture'));
  if (pause < 0 && goOn < 0) return undefined;
  return pause > goOn ? 'pause' : 'go on';
}

/** Pauses by voice, where this browser recognises speech, and only while it was asked to listen. */
export class SpokenPause {
  listening = false;
  problem = '';
  private recognition: Recognition | undefined;

  constructor(private readonly obey: (paused: boolean) => void) {}

  static get supported(): boolean {
    return 'SpeechRecognition' in window || 'webkitSpeechRecognition' in window;
  }

  toggle(): void {
    this.listening = !this.listening;
    this.problem = '';
    if (this.listening) this.start();
    else this.recognition?.abort();
  }

  private start(): void {
    const scope = window as unknown as Record<string, new () => Recognition>;
    const Maker = scope['SpeechRecognition'] ?? scope['webkitSpeechRecognition'];
    if (!Maker) return;
    const recognition = (this.recognition = new Maker());
    recognition.continuous = true;
    recognition.interimResults = false;
    recognition.lang = 'en';
    recognition.onresult = ({ results }) => {
      const order = orderIn(results[results.length - 1]?.[0]?.transcript ?? '');
      if (order) this.obey(order === 'pause');
    };
    recognition.onerror = ({ error }) => {
      if (error === 'no-speech' || error === 'aborted') return;
      this.listening = false;
      this.problem = `Speech is not recognised here (${error}): press P, or the button.`;
    };
    recognition.onend = () => {
      if (this.listening) this.start(); // browsers end it after a silence
    };
    recognition.start();
  }
}
