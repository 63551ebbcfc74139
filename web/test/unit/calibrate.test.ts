import { create } from '@bufbuild/protobuf';
import { expect, test } from 'vitest';
import {
  CalibrationFitSchema,
  CalibrationPhase,
  CalibrationSchema,
} from '../../src/gen/saccade/v1/calibration_pb';
import { arrowScale } from '../../src/ui/calibrate_draw';
import {
  adviceWords,
  kindOf,
  KINDS,
  phaseWords,
  progressWords,
  rmsWords,
  targetText,
  valueWords,
} from '../../src/ui/calibrate_words';

test('a form becomes a target as the server reads it', () => {
  const fields = (kind: string) => ({ kind, ...kindOf(kind).start });
  expect(KINDS.map(({ kind }) => targetText(fields(kind)))).toEqual([
    'chessboard:9x6:0.025',
    'charuco:7x5:0.04:0.03:aruco_4x4_50',
    'aprilgrid:6x6:0.088:0.3',
    'arucogrid:5x7:0.04:0.01:aruco_4x4_50',
  ]);
  const typed = { ...fields('charuco'), columns: ' 8 ', side: '0,05', family: 'aruco_5x5_250' };
  expect(targetText(typed)).toBe('charuco:8x5:0.05:0.03:aruco_5x5_250');
});

test('what is going on, and what to do, in words', () => {
  const now = create(CalibrationSchema, {
    phase: CalibrationPhase.SHOWING,
    targetWords: 'board of 9 x 6 corners, 0.025 m',
    advice: 'move the board to the left edge',
    views: 7,
    enoughViews: 24,
    covered: 0.625,
  });
  expect(phaseWords(undefined)).toBe('asking the server');
  expect(phaseWords(now)).toBe('looking for the board of 9 x 6 corners, 0.025 m');
  expect(adviceWords(now)).toBe('Move the board to the left edge');
  expect(adviceWords({ ...now, advice: '' })).toMatch(/^Enough/);
  expect(progressWords(now)).toBe('7 of 24 views, 63 % of the picture');
  const failed = { ...now, phase: CalibrationPhase.FAILED, problem: 'too little' };
  expect(adviceWords(failed)).toBe('Too little');
  expect(rmsWords(undefined)).toBe('');
  expect(rmsWords(create(CalibrationFitSchema, { rmsPx: 0.12345 }))).toBe('RMS 0.123 px');
});

test('a value has as many digits as its sigma deserves', () => {
  expect(valueWords(458.6543, 0.213)).toEqual({ value: '458.65', sigma: '0.21' });
  expect(valueWords(-0.283408, 0.00042)).toEqual({ value: '-0.28341', sigma: '0.00042' });
  expect(valueWords(367.2, 13)).toEqual({ value: '367', sigma: '13' });
});

test('arrows are drawn so many times too long that the median one can be seen', () => {
  const errors = (length: number) => [0, 0, length, 0, 9, 9, 0, length, 5, 5, length, 0];
  expect(arrowScale(errors(0.1), 752)).toBe(200);
  expect(arrowScale(errors(1), 752)).toBe(20);
  expect(arrowScale(errors(500), 752)).toBe(1);
  expect(arrowScale([], 752)).toBe(1);
});
