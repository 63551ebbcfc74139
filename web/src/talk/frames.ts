/** Voice as it is coded and sent: Opus, mono. */
export const SAMPLE_RATE_HZ = 48_000;
export const FRAME_MS = 20;
export const FRAME = (SAMPLE_RATE_HZ * FRAME_MS) / 1000; // samples
export const MOST_OPUS_BYTES = 400;

/** Root mean square, 0 to 1. */
export function loudness(samples: Float32Array): number {
  let sum = 0;
  for (const sample of samples) sum += sample * sample;
  return Math.sqrt(sum / Math.max(samples.length, 1));
}
