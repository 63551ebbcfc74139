const HELD_UP_MS = 20_000; // timers of a page in the background run once a minute at worst, but with data

/** Why a stream that told nothing for so long was given up; `heldUpMs`: since we last could look. */
export function silenceWords(silentMs: number, heldUpMs: number): string {
  const told = `no data for ${spanWords(silentMs)}`;
  return heldUpMs > HELD_UP_MS ? `${told}: this computer slept` : told;
}

/** "12 s", "8 min", "3 h". */
export function spanWords(ms: number): string {
  const seconds = Math.max(0, Math.round(ms / 1000));
  if (seconds < 100) return `${seconds} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 100 ? `${minutes} min` : `${Math.round(minutes / 60)} h`;
}
