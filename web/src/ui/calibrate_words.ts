import { type Calibration, type CalibrationFit, CalibrationPhase } from '../session/calibration';

/** A target in the words of a form: how many, how large [m]. */
export interface TargetFields {
  readonly kind: string;
  readonly columns: string;
  readonly rows: string;
  readonly side: string;
  readonly second: string; // of a marker, or the gap; not of a chessboard
  readonly family: string; // of ArUco markers
}

interface Kind {
  readonly kind: string;
  readonly name: string;
  readonly counted: string;
  readonly side: string;
  readonly second?: string;
  readonly families: boolean;
  readonly start: Omit<TargetFields, 'kind'>;
}

const ARUCO = 'aruco_4x4_50';

export const FAMILIES = [
  ...[ARUCO, 'aruco_4x4_100', 'aruco_5x5_250', 'aruco_6x6_250', 'aruco_7x7_250'],
  'aruco_original',
];

export const KINDS: readonly Kind[] = [
  {
    kind: 'chessboard',
    name: 'Chessboard',
    counted: 'inner corners, where four squares meet',
    side: 'Side of a square [m]',
    families: false,
    start: { columns: '9', rows: '6', side: '0.025', second: '', family: '' },
  },
  {
    kind: 'charuco',
    name: 'ChArUco board',
    counted: 'squares',
    side: 'Side of a square [m]',
    second: 'Side of a marker [m]',
    families: true,
    start: { columns: '7', rows: '5', side: '0.04', second: '0.03', family: ARUCO },
  },
  {
    kind: 'aprilgrid',
    name: 'AprilGrid (Kalibr)',
    counted: 'tags',
    side: 'Side of a tag [m]',
    second: 'Gap, as a share of the side',
    families: false,
    start: { columns: '6', rows: '6', side: '0.088', second: '0.3', family: '' },
  },
  {
    kind: 'arucogrid',
    name: 'ArUco grid (OpenCV)',
    counted: 'markers',
    side: 'Side of a marker [m]',
    second: 'Gap between two [m]',
    families: true,
    start: { columns: '5', rows: '7', side: '0.04', second: '0.01', family: ARUCO },
  },
];

export const kindOf = (kind: string): Kind =>
  KINDS.find((each) => each.kind === kind) ?? (KINDS[0] as Kind);

/** As the server reads it: "charuco:7x5:0.04:0.03:aruco_4x4_50". */
export function targetText(fields: TargetFields): string {
  const kind = kindOf(fields.kind);
  const number = (text: string): string => text.trim().replace(',', '.');
  const sizes = [fields.side, ...(kind.second === undefined ? [] : [fields.second])];
  const parts = [
    kind.kind,
    `${fields.columns.trim()}x${fields.rows.trim()}`,
    ...sizes.map(number),
    ...(kind.families ? [fields.family] : []),
  ];
  return parts.join(':');
}

/** What is going on, in a few words. */
export function phaseWords(now: Calibration | undefined): string {
  switch (now?.phase) {
    case CalibrationPhase.SHOWING:
      return `looking for the ${now.targetWords}`;
    case CalibrationPhase.FITTING:
      return 'finding the lens';
    case CalibrationPhase.DONE:
      return 'done';
    case CalibrationPhase.FAILED:
      return 'failed';
    case CalibrationPhase.IDLE:
      return 'not started';
    default:
      return 'asking the server';
  }
}

/** What a person is to do next. */
export function adviceWords(now: Calibration | undefined): string {
  switch (now?.phase) {
    case CalibrationPhase.SHOWING:
      return now.advice === '' ? 'Enough: the lens is being found' : capital(now.advice);
    case CalibrationPhase.FITTING:
      return 'Put it down: the lens is being found';
    case CalibrationPhase.DONE:
      return 'Done: here is the lens';
    case CalibrationPhase.FAILED:
      return capital(now.problem);
    default:
      return 'Choose what you hold before the camera, and start';
  }
}

const capital = (words: string): string => words.charAt(0).toUpperCase() + words.slice(1);

export function progressWords({ views, enoughViews, covered }: Calibration): string {
  return `${views} of ${enoughViews} views, ${Math.round(100 * covered)} % of the picture`;
}

/** RMS so far; empty: not known yet. */
export const rmsWords = (fit: CalibrationFit | undefined): string =>
  fit === undefined ? '' : `RMS ${fit.rmsPx.toFixed(3)} px`;

/** A value with as many digits as its sigma deserves. */
export function valueWords(value: number, sigma: number): { value: string; sigma: string } {
  const digits = sigma > 0 ? Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(sigma)))) : 5;
  return { value: value.toFixed(digits), sigma: sigma.toFixed(digits) };
}
