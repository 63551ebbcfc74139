import type { FeatureState } from '../session/types';

/**
 * Fixed by the source (Davison 2003): red measured, blue failed, yellow not attempted, green the
 * fixation target. Nothing else on the page may use these four.
 */
export const FEATURE_CSS: Record<FeatureState, string> = {
  measured: '#ff5a4d',
  failed: '#4da3ff',
  not_attempted: '#ffd84d',
};

export const TARGET_CSS = '#57d977';
