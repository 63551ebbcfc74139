export interface Motion {
  readonly timeMs: number; // performance.timeOrigin + event.timeStamp
  readonly acceleration: readonly [number, number, number]; // with gravity [m/s^2]
  readonly angularVelocity: readonly [number, number, number]; // [rad/s]
}

const EVERY_MS = 15; // at most
const RAD = Math.PI / 180;

interface AsksFirst {
  requestPermission?: () => Promise<string>;
}

/**
 * Asks where a phone wants to be asked (iOS), which takes a tap; then `sink` hears of each sample,
 * for as long as the page is there. False: it may not.
 */
export async function watchMotion(sink: (motion: Motion) => void): Promise<boolean> {
  if (typeof DeviceMotionEvent === 'undefined') return false;
  const { requestPermission } = DeviceMotionEvent as unknown as AsksFirst;
  if (requestPermission && (await requestPermission().catch(() => 'denied')) !== 'granted')
    return false;
  let lastMs = -Infinity;
  window.addEventListener('devicemotion', (event) => {
    const motion = motionOf(event, performance.timeOrigin);
    if (!motion || motion.timeMs - lastMs < EVERY_MS) return;
    lastMs = motion.timeMs;
    sink(motion);
  });
  return true;
}

/** Undefined where the phone has no such sensors: then browsers send one event without values. */
export function motionOf(
  event: Pick<DeviceMotionEvent, 'timeStamp' | 'accelerationIncludingGravity' | 'rotationRate'>,
  timeOrigin: number,
): Motion | undefined {
  const { accelerationIncludingGravity: a, rotationRate: r } = event;
  if (a?.x == null || a.y == null || a.z == null) return undefined;
  // alpha turns about z, beta about x, gamma about y.
  const turn = [r?.beta ?? 0, r?.gamma ?? 0, r?.alpha ?? 0] as const;
  return {
    timeMs: timeOrigin + event.timeStamp,
    acceleration: [a.x, a.y, a.z],
    angularVelocity: [turn[0] * RAD, turn[1] * RAD, turn[2] * RAD],
  };
}
