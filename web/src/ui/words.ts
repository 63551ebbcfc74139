import type { Annotation, Link, Pose } from '../session/types';

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
}

export function statusWords({ link, pose, sourceEnded, nowMs }: StatusInput): StatusWords {
  switch (link.kind) {
    case 'connecting':
      return { mark: '◌', text: 'connecting', advice: '', warn: false };
    case 'refused':
      return { mark: '■', text: 'refused', advice: link.reason, warn: true };
    case 'reconnecting': {
      const seconds = Math.max(0, Math.round((nowMs - link.sinceMs) / 1000));
      return { mark: '◌', text: `reconnecting, ${seconds} s`, advice: link.reason, warn: true };
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
  return trackingWords(pose);
}

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

/** "2 experts, 1 wearer". */
export function presenceWords(participants: readonly { readonly role: string }[]): string {
  const counts = ['expert', 'wearer', 'viewer'].map((role) => {
    const count = participants.filter((participant) => participant.role === role).length;
    return count === 0 ? '' : `${count} ${role}${count === 1 ? '' : 's'}`;
  });
  return counts.filter(Boolean).join(', ');
}

/** Error of an anchor: "0.8 px  3 mm", or why it is not to be trusted. */
export function anchorWords(
  { anchor }: Annotation,
  metric: boolean,
): { text: string; warn: boolean } {
  if (anchor.state === 'paused') {
    return { text: `do not trust${anchor.reason ? `: ${anchor.reason}` : ''}`, warn: true };
  }
  if (anchor.state === 'stopped') {
    return { text: `stopped${anchor.reason ? `: ${anchor.reason}` : ''}`, warn: true };
  }
  if (!anchor.pointInWorld) return { text: 'place not known', warn: true };
  const px = anchor.errorPx === undefined ? 'out of view' : `${anchor.errorPx.toFixed(1)} px`;
  const size = metric ? ` · ${millimetres(anchor.errorMm)}` : ' · scale unknown';
  return { text: `${px}${size}`, warn: false };
}

function millimetres(mm: number): string {
  return mm < 100 ? `${mm.toFixed(mm < 9.95 ? 1 : 0)} mm` : `${(mm / 10).toFixed(0)} cm`;
}
