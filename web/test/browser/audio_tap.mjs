// When a tone begins in the page's own sound: at its microphone, and where it plays. Runs in the page.

/** For addInitScript: keeps onsets in window.onsets, milliseconds since 1970 by the page's clock. */
export function tapAudio() {
  window.onsets = { microphone: [], played: [] };
  const processor = `
    class Tap extends AudioWorkletProcessor {
      constructor() { super(); this.quiet = 0; }
      process([[samples]]) {
        if (!samples) return true;
        for (let i = 0; i < samples.length; ++i) {
          const loud = Math.abs(samples[i]) > 0.03;
          if (loud && this.quiet > 0.25 * sampleRate) this.port.postMessage({ onsetS: currentTime + i / sampleRate });
          this.quiet = loud ? 0 : this.quiet + 1;
        }
        this.port.postMessage({ nowS: currentTime });
        return true;
      }
    }
    registerProcessor('tap', Tap);`;
  const url = URL.createObjectURL(new Blob([processor], { type: 'text/javascript' }));
  const { connect } = AudioNode.prototype;
  const tap = async (context, source, list) => {
    await context.audioWorklet.addModule(url);
    const node = new AudioWorkletNode(context, 'tap', { numberOfOutputs: 0 });
    let offsetMs = Infinity; // of the page's clock over the audio's, at the quickest
    node.port.onmessage = ({ data }) => {
      const nowMs = performance.timeOrigin + performance.now();
      if (data.nowS !== undefined) offsetMs = Math.min(offsetMs + 0.002, nowMs - 1000 * data.nowS);
      else list.push(1000 * data.onsetS + offsetMs);
    };
    connect.call(source, node);
  };
  AudioNode.prototype.connect = function (to, ...rest) {
    if (to === this.context.destination && this instanceof AudioWorkletNode) {
      void tap(this.context, this, window.onsets.played);
    }
    return connect.call(this, to, ...rest);
  };
  const { createMediaStreamSource } = AudioContext.prototype;
  AudioContext.prototype.createMediaStreamSource = function (stream) {
    const source = createMediaStreamSource.call(this, stream);
    void tap(this, source, window.onsets.microphone);
    return source;
  };
}

/** A WAV file: a tone of 0.25 s in each second, as loud as speech. */
export function toneWav({ hz, seconds = 10, rateHz = 48_000 }) {
  const samples = Buffer.alloc(2 * seconds * rateHz);
  for (let i = 0; i < seconds * rateHz; ++i) {
    const t = (i / rateHz) % 1;
    const edge = Math.min(1, t / 0.002, Math.max(0, (0.25 - t) / 0.01));
    // Three partials that beat: a steady tone would be taken for noise.
    const tone = [1, 1.5, 2.02].reduce((sum, k) => sum + Math.sin(2 * Math.PI * hz * k * t), 0) / 3;
    samples.writeInt16LE(Math.round(18_000 * Math.max(0, edge) * tone), 2 * i);
  }
  const head = Buffer.alloc(44);
  head.write('RIFF', 0);
  head.writeUInt32LE(36 + samples.length, 4);
  head.write('WAVEfmt ', 8);
  head.writeUInt32LE(16, 16);
  head.writeUInt16LE(1, 20);
  head.writeUInt16LE(1, 22);
  head.writeUInt32LE(rateHz, 24);
  head.writeUInt32LE(2 * rateHz, 28);
  head.writeUInt16LE(2, 32);
  head.writeUInt16LE(16, 34);
  head.write('data', 36);
  head.writeUInt32LE(samples.length, 40);
  return Buffer.concat([head, samples]);
}

/** From each onset at the microphone to the one that was heard for it [ms]; those not heard are left out. */
export function delays(spoken, heard) {
  return spoken.flatMap((at) => {
    const later = heard.filter((one) => one > at && one < at + 900);
    return later.length === 0 ? [] : [Math.min(...later) - at];
  });
}
