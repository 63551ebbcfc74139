import type { UplinkState } from '../uplink/socket';
import type { CameraState } from '../uplink/wear_camera';
import { spanWords } from '../session/silence';
import type { Link } from '../session/types';

export interface WearWords {
  readonly text: string;
  readonly warn: boolean;
}

export interface WearInput {
  readonly link: Link;
  readonly uplink: UplinkState | undefined;
  readonly camera: CameraState;
  readonly paused: boolean;
  readonly problem: string;
  readonly untrackedMs: number; // since a picture was last tracked
  readonly tracking: WearWords; // of the newest that was
  readonly nowMs: number;
}

const QUIET_MS = 1500;

/** One line: what is wrong and what to do, else how tracking goes. */
export function wearWords(input: WearInput): WearWords {
  const { link, uplink, camera, paused, problem, untrackedMs, tracking, nowMs } = input;
  const warn = (text: string): WearWords => ({ text, warn: true });
  if (link.kind === 'refused') return warn(`refused: ${link.reason}`);
  if (uplink?.kind === 'refused') return warn(`refused: ${uplink.reason}`);
  if (camera.kind === 'failed') return warn('no camera');
  if (camera.kind === 'off') return { text: 'not started', warn: false };
  if (camera.kind === 'opening') return { text: 'opening the camera', warn: false };
  if (uplink === undefined || uplink.kind === 'connecting') {
    return { text: 'connecting', warn: false };
  }
  if (uplink.kind === 'reconnecting') {
    return warn(`reconnecting, ${spanWords(nowMs - uplink.sinceMs)}: ${uplink.reason}`);
  }
  if (problem) return warn(problem);
  if (paused) return warn('picture paused: nobody sees the camera; the map stays live');
  if (untrackedMs > QUIET_MS) return warn('sending; the server tracks nothing yet');
  return tracking;
}

/** "62 ms from the camera to these marks · 28 pictures a second · H.264". */
export function latencyWords(
  totalMs: number | undefined,
  fps: number,
  codec: string,
  held: number,
): string {
  const words = [
    totalMs === undefined ? 'no latency yet' : `${Math.round(totalMs)} ms camera to marks`,
    `${fps.toFixed(0)} fps`,
    codec,
  ];
  if (held > 0) words.push(`${held} left out`);
  return words.filter(Boolean).join(' · ');
}
