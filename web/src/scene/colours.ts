import { Color } from 'three';
import type { FeatureState } from '../session/types';
import { FEATURE_CSS } from './feature_css';

export const FEATURE_COLOURS: Record<FeatureState, Color> = {
  measured: new Color(FEATURE_CSS.measured),
  failed: new Color(FEATURE_CSS.failed),
  not_attempted: new Color(FEATURE_CSS.not_attempted),
};
