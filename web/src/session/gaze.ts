import type { Vec3 } from '../geometry/vec3';

export type GazeMode =
  | 'no_mount'
  | 'idle'
  | 'saccade'
  | 'fixate'
  | 'horizon'
  | 'home'
  | 'stopped'
  | 'explore'
  | 'parked';

export type GazeTarget =
  | { readonly kind: 'annotation'; readonly annotationId: string }
  | { readonly kind: 'feature'; readonly featureId: number }
  | { readonly kind: 'point'; readonly pointInWorld: Vec3 };

/** Someone who steers the head, or waits to. */
export interface Pilot {
  readonly participantId: string;
  readonly name: string;
}

/** The head's joints by its encoders [rad]: right, up and clockwise are positive. */
export interface HeadAngles {
  readonly pan: number;
  readonly elevation: number;
  readonly cyclotorsion: number;
}

/** What the head does and who steers it, as the server tells everybody. */
export interface Gaze {
  readonly mode: GazeMode;
  readonly angles: HeadAngles | undefined;
  readonly target: GazeTarget | undefined;
  readonly targetInWorld: Vec3 | undefined;
  readonly errorRad: number | undefined;
  readonly arrived: boolean;
  readonly targetLost: boolean;
  readonly unreachable: boolean;
  readonly missRad: number;
  readonly fast: boolean;
  readonly problem: string;
  readonly pilot: Pilot | undefined;
  readonly queue: readonly Pilot[];
  readonly paused: boolean;
  readonly handovers: number;
  readonly lastHandover: string;
  /** Where in the picture a target lies that the head cannot reach: from straight right, clockwise. */
  readonly guidanceRad: number | undefined;
  readonly timeNs: bigint;
}

/** The server's words about a change of hands, for the one whom they call vanished, but who is there. */
export function ownHandover(words: string, myName: string): string {
  const vanished = `${myName} vanished; `;
  if (!words.startsWith(vanished)) return words;
  return `this page was not heard in time; ${words.slice(vanished.length)}`;
}

/** True where there is something to turn: a motorised head, or a crop of the picture. */
export const hasHead = (gaze: Gaze | undefined): gaze is Gaze =>
  gaze !== undefined && gaze.mode !== 'no_mount';

/** Changes when something happens, not with every angle and error. */
export function gazeKey(gaze: Gaze | undefined): string {
  if (!gaze) return '';
  const { mode, arrived, targetLost, unreachable, paused, handovers, queue, problem } = gaze;
  return [mode, arrived, targetLost, unreachable, paused, handovers, queue.length, problem].join();
}
