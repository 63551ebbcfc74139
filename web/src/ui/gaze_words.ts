import { charactersOf } from '../scene/characters';
import { type Gaze, type HeadAngles, ownHandover } from '../session/gaze';
import type { Lease } from '../session/gaze_pilot';
import type { Annotation, Participant, Shape } from '../session/types';
import { shapeWord } from './words';

/** What the head does, in words; a shape beside them, never colour alone. */
export interface GazeWords {
  readonly mark: '●' | '◐' | '○' | '■';
  readonly text: string;
  readonly number: string; // what changes all the time
  readonly advice: string;
  readonly warn: boolean;
}

export interface GazeInput {
  readonly gaze: Gaze | undefined;
  /** The one that the target names, if it does. */
  readonly annotation: Annotation | undefined;
}

const DEGREE = Math.PI / 180;
const HOME_RAD = 0.5 * DEGREE;

export const degrees = (rad: number): string => `${(rad / DEGREE).toFixed(1)} deg`;

const SIDES = [
  'right',
  'right and down',
  'down',
  'left and down',
  'left',
  'left and up',
  'up',
  'right and up',
] as const;

/** Which way an angle of the picture points: from straight right, clockwise. */
export function sideOf(angleRad: number): string {
  const eighth = Math.round(angleRad / (Math.PI / 4));
  return SIDES[((eighth % 8) + 8) % 8] ?? 'right';
}

/** "12 deg right, 4 deg up" of the wearer's straight ahead. */
export function directionWords({ pan, elevation }: HeadAngles): string {
  const part = (rad: number, more: string, less: string): string => {
    const whole = Math.round(rad / DEGREE);
    return whole === 0 ? '' : `${Math.abs(whole)} deg ${whole > 0 ? more : less}`;
  };
  const parts = [part(pan, 'right', 'left'), part(elevation, 'up', 'down')].filter(Boolean);
  return parts.join(', ') || 'straight ahead';
}

/** What is looked at. */
export function targetWords({ gaze, annotation }: GazeInput): string {
  switch (gaze?.target?.kind) {
    case 'annotation':
      if (!annotation) return 'a mark';
      return annotation.text ? `“${shorten(annotation.text)}”` : aShape(annotation.shape);
    case 'feature':
      return `feature ${gaze.target.featureId}`;
    case 'point':
      return 'a point';
    case undefined:
      return 'nothing';
  }
}

const aShape = (shape: Shape): string => `${shape === 'arrow' ? 'an' : 'a'} ${shapeWord(shape)}`;

function shorten(text: string): string {
  const characters = charactersOf(text);
  return characters.length > 24 ? `${characters.slice(0, 23).join('')}…` : text;
}

export function gazeWords(input: GazeInput): GazeWords {
  const { gaze } = input;
  const plain = (mark: GazeWords['mark'], text: string): GazeWords => {
    const problem = gaze?.problem ?? '';
    return { mark, text, number: '', advice: problem, warn: problem !== '' };
  };
  switch (gaze?.mode) {
    case undefined:
      return plain('○', 'not known now');
    case 'no_mount':
      return plain('○', 'fixed to the wearer: no head to turn');
    case 'idle':
      return plain('○', 'at rest');
    case 'saccade':
    case 'fixate':
      return towardsWords(gaze, targetWords(input));
    case 'horizon':
      return plain('●', 'keeping the picture level');
    case 'home': {
      const { angles } = gaze;
      const there = angles && Math.hypot(angles.pan, angles.elevation) < HOME_RAD;
      return there ? plain('●', 'looking straight ahead') : plain('◐', 'turning straight ahead');
    }
    case 'stopped':
      return plain('■', 'stopped');
    case 'explore':
      return plain('◐', 'looking round where the map is least certain');
    case 'parked':
      return plain('◐', gaze.pilot ? 'slowly straight ahead' : 'pilot gone: slowly straight ahead');
  }
}

/** On its way to a target, or holding it. */
function towardsWords(gaze: Gaze, target: string): GazeWords {
  const { mode, errorRad, arrived, targetLost, unreachable, missRad, problem } = gaze;
  const number = errorRad === undefined ? '' : degrees(errorRad);
  const advice: string[] = problem ? [problem] : [];
  if (unreachable) advice.push(unreachableWords(gaze, missRad));
  if (targetLost) advice.push('Target lost: it is no longer in the map. Its last place is held.');
  const warn = advice.length > 0;
  if (unreachable) {
    return { mark: '◐', text: `out of reach: ${target}`, number, advice: advice.join(' '), warn };
  }
  const rest = { advice: advice.join(' '), warn };
  if (arrived) return { mark: '●', text: `holding ${target}`, number, ...rest };
  const left = number && (mode === 'saccade' ? `${number} to go` : `off by ${number}`);
  const text = mode === 'saccade' ? `turning to ${target}` : `following ${target}`;
  return { mark: '◐', text, number: left, ...rest };
}

function unreachableWords({ angles, guidanceRad }: Gaze, missRad: number): string {
  const nearest = angles ? ` (${directionWords(angles)})` : '';
  const turn = guidanceRad === undefined ? '' : ` Ask the wearer to turn ${sideOf(guidanceRad)}.`;
  return `The head misses it by ${degrees(missRad)}: this is as near as it can look${nearest}.${turn}`;
}

/** Few words beside the target's own mark. */
export function targetLabel(gaze: Gaze): string {
  const number = gaze.errorRad === undefined ? '' : degrees(gaze.errorRad);
  if (gaze.targetLost) return 'target lost';
  if (gaze.unreachable) return `out of reach, ${number}`;
  if (gaze.arrived) return `holding, ${number}`;
  return gaze.mode === 'saccade' ? `turning, ${number}` : `following, ${number}`;
}

/** Beside the arrow that points to it from the picture's edge. */
export function arrowLabel(gaze: Gaze): string {
  const { guidanceRad: angle } = gaze;
  return angle === undefined ? targetLabel(gaze) : `out of reach: wearer, turn ${sideOf(angle)}`;
}

export const ordinal = (n: number): string => {
  const ends =
    n % 100 >= 11 && n % 100 <= 13 ? 'th' : ({ 1: 'st', 2: 'nd', 3: 'rd' }[n % 10] ?? 'th');
  return `${n}${ends}`;
};

export interface SteerInput {
  readonly gaze: Gaze;
  readonly lease: Lease;
  readonly me: string; // session id
  readonly participants: readonly Participant[];
}

/** Who pilots, who waits, and what place in the queue is mine. */
export function steerWords({ gaze, lease, me, participants }: SteerInput): string {
  const { pilot, queue, paused } = gaze;
  const wearer = participants.some(
    (one) => one.participantId === pilot?.participantId && one.role === 'wearer',
  );
  const parts: string[] = [];
  if (paused) parts.push('paused by the wearer');
  if (!pilot) parts.push('nobody pilots');
  else if (pilot.participantId === me) parts.push('you pilot');
  else parts.push(wearer ? 'the wearer has taken over' : `${pilot.name} pilots`);
  const place = queue.findIndex(({ participantId }) => participantId === me) + 1;
  const mine = place > 0 ? place : lease.kind === 'waiting' ? lease.position : 0;
  if (mine > 0) parts.push(`you are ${ordinal(mine)} in the queue`);
  const others = queue.filter(({ participantId }) => participantId !== me).map(({ name }) => name);
  if (others.length > 0)
    parts.push(`${others.join(', ')} ${others.length === 1 ? 'waits' : 'wait'}`);
  return parts.join(' · ');
}

/** A change of hands for everybody to read; `lostBy`: my name, where it was I who piloted before. */
export function handoverWords(gaze: Gaze, me: string, lostBy?: string): string {
  const mine = gaze.pilot !== undefined && gaze.pilot.participantId === me;
  const told = gaze.lastHandover;
  const words = lostBy === undefined ? told : ownHandover(told, lostBy);
  if (!words) return '';
  if (!mine) return `Camera: ${words}.`;
  return words === `${gaze.pilot.name} pilots`
    ? 'You pilot the camera now.'
    : `You pilot the camera now: ${words}.`;
}
