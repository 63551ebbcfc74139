import { isRecorder } from '../session/recording';
import { spanWords } from '../session/silence';
import { MAX_STREAMS } from '../session/tabs';
import type { PicturePause } from '../session/talk_state';
import {
  type Annotation,
  doNotTrust,
  excessOf,
  type Link,
  type Pose,
  type Scale,
  type Shape,
  type Participant,
} from '../session/types';

/** The state of things in words, with what to do about it. Never colour alone: a shape as well. */
export interface StatusWords {
  readonly mark: '●' | '◐' | '○' | '◌' | '■';
  readonly text: string;
  readonly advice: string;
  readonly warn: boolean;
}

export interface StatusInput {
  readonly link: Link;
  readonly pose: Pose | undefined;
  readonly sourceEnded: boolean;
  readonly nowMs: number;
  readonly poseMs?: number; // when the pose came; absent: just now
  readonly paused?: boolean; // by the wearer: the picture is not missed
}

const NO_PICTURE_MS = 2000;
const WAITING_ADVICE = 'the wearer sees that you are here; this page goes on by itself';

export function statusWords(input: StatusInput): StatusWords {
  const { link, pose, sourceEnded, nowMs, poseMs = nowMs } = input;
  switch (link.kind) {
    case 'connecting':
      return { mark: '◌', text: 'connecting', advice: '', warn: false };
    case 'waiting':
      return { mark: '◌', text: 'waiting to be let in', advice: WAITING_ADVICE, warn: false };
    case 'crowded':
      return { mark: '■', text: 'too many tabs', advice: crowdedWords(link.tabs), warn: true };
    case 'refused':
      return { mark: '■', text: 'refused', advice: link.reason, warn: true };
    case 'reconnecting': {
      const span = spanWords(nowMs - link.sinceMs);
      return { mark: '◌', text: `reconnecting, ${span}`, advice: link.reason, warn: true };
    }
    case 'live':
      break;
  }
  if (sourceEnded) {
    return {
      mark: '■',
      text: 'recording ended',
      advice: 'the last picture and map stay',
      warn: false,
    };
  }
  if (input.paused) {
    return { mark: '■', text: 'picture paused', advice: 'the map stays live', warn: false };
  }
  if (pose && nowMs - poseMs > NO_PICTURE_MS) {
    return {
      mark: '○',
      text: `no picture for ${spanWords(nowMs - poseMs)}`,
      advice: 'the camera sends none: a phone may be away, or without network',
      warn: true,
    };
  }
  return trackingWords(pose);
}

/** Why a page stands still while other tabs of the same browser do not, and what to do. */
export const crowdedWords = (tabs: number): string =>
  `Saccade is open in ${tabs} other tabs of this browser, which has connections for ${MAX_STREAMS} at a time. Close ${tabs - MAX_STREAMS + 1} of them: this one then goes on by itself.`;

function trackingWords(pose: Pose | undefined): StatusWords {
  switch (pose?.status) {
    case undefined:
    case 'unknown':
      return { mark: '◌', text: 'waiting for the first picture', advice: '', warn: false };
    case 'initialising':
      return {
        mark: '◌',
        text: 'starting',
        advice: pose.advice || 'move the camera sideways, slowly',
        warn: false,
      };
    case 'tracking': {
      const good = pose.quality === 'good';
      const quality = pose.quality === 'unknown' ? '' : ` ${pose.quality}`;
      return {
        mark: good ? '●' : '◐',
        text: `tracking${quality}`,
        advice: pose.advice,
        warn: pose.quality === 'poor' || pose.quality === 'bad',
      };
    }
    case 'coasting':
      return {
        mark: '◐',
        text: 'coasting',
        advice: pose.advice || 'too little is recognised: the pose is a prediction',
        warn: true,
      };
    case 'lost':
      return {
        mark: '○',
        text: 'lost',
        advice: pose.advice || 'show a place seen before',
        warn: true,
      };
    case 'relocalising':
      return {
        mark: '○',
        text: 'searching its place',
        advice: pose.advice || 'show a place seen before',
        warn: true,
      };
  }
}

/** For the picture of a camera that does not know where it is: what that means for it. */
export function lostWords(pose: Pose | undefined): string {
  if (pose?.status !== 'lost' && pose?.status !== 'relocalising') return '';
  const { text, advice } = trackingWords(pose);
  const words = advice.replace(/\.$/, '');
  return `${text === 'lost' ? 'Lost' : 'Searching its place'}: ${words}. Marks come back with it`;
}

/** "Ann paused the picture at 12:03; the map stays live". */
export const pauseWords = ({ by, sinceMs }: PicturePause): string =>
  `${by || 'The wearer'} paused the picture at ${clockWords(sinceMs)}; the map stays live`;

/** "12:03", where this browser is. */
export const clockWords = (unixMs: number): string =>
  new Date(unixMs).toLocaleTimeString([], { hour: '2-digit', minute: '2-digit', hour12: false });

/** "1 frame", "2 frames". */
export const counted = (count: number, thing: string): string =>
  `${count} ${thing}${count === 1 ? '' : 's'}`;

/** What a person calls a mark of this shape. */
export const shapeWord = (shape: Shape): string =>
  shape === 'ink' ? 'stroke' : shape.replace('_', ' ');

/** "2 experts, 1 wearer, recorded". */
export function presenceWords(
  present: readonly Pick<Participant, 'role' | 'participantId'>[],
): string {
  const participants = present.filter((each) => !isRecorder(each));
  const recorded = participants.length < present.length ? 'recorded' : '';
  const counts = ['expert', 'wearer', 'viewer'].map((role) => {
    const count = participants.filter((participant) => participant.role === role).length;
    return count === 0 ? '' : counted(count, role);
  });
  return [...counts, recorded].filter(Boolean).join(', ');
}

/** With its age, if it is old. */
export const dated = (text: string, ageMs: number | undefined): string =>
  ageMs === undefined ? text : `${text} · as of ${spanWords(ageMs)} ago`;

/** Error of an anchor: "0.8 px · 3 mm", or why it is not to be trusted. */
export function anchorWords({ anchor }: Annotation, scale: Scale): { text: string; warn: boolean } {
  const { state, reason, errorPx, errorMm, pointInWorld } = anchor;
  const { metric } = scale;
  const why = placeable(reason, metric);
  if (state === 'paused') return { text: `do not trust${why ? `: ${why}` : ''}`, warn: true };
  if (state === 'stopped') return { text: `stopped${why ? `: ${why}` : ''}`, warn: true };
  if (!pointInWorld) return { text: 'place not known', warn: true };
  const px = errorPx === undefined ? 'out of view' : `${errorPx.toFixed(1)} px`;
  const size = metric ? ` · ${millimetres(errorMm)}` : ' · scale unknown';
  if (!doNotTrust(anchor, scale)) return { text: `${px}${size}`, warn: false };
  const error = excessOf(anchor, scale).mm ? millimetres(errorMm) : px;
  return { text: `do not trust: expected error ${error}`, warn: true };
}

/** The server's reason, without what nobody can do here, and without lengths where there is no scale. */
function placeable(reason: string, metric: boolean): string {
  const possible = reason.replace(/; move it$/, '; delete it and place it anew');
  return metric
    ? possible
    : possible.replace(
        /expected error [\d.]+ mm is above [\d.]+ mm/,
        'too uncertain; scale unknown',
      );
}

/** "3.0 mm", "53 cm", "2.3 m". */
export function millimetres(mm: number): string {
  if (mm < 100) return `${mm.toFixed(mm < 9.95 ? 1 : 0)} mm`;
  return mm < 995 ? `${(mm / 10).toFixed(0)} cm` : `${(mm / 1000).toFixed(1)} m`;
}
