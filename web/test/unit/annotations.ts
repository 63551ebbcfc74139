import type { Annotation } from '../../src/session/types';

/** What an annotation has that only some shapes use. */
export const PLAIN = {
  ...{ authorPersonId: '', locked: false, worldFromMark: undefined, extentM: undefined },
  ...{ number: 0, lengthM: 0, lengthSigmaM: 0, picture: undefined, inkOffsetsM: [] },
  checkItems: [],
} as const satisfies Partial<Annotation>;
