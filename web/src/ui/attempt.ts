import { EditError } from '../session/edits';
import type { AppState, Place } from './app_state';

export const reasonOf = (error: unknown): string =>
  error instanceof EditError ? error.message : String(error);

/** Runs an edit; a refusal is shown where it was asked for, after `words`. */
export function attempt(
  state: AppState,
  where: Place,
  edit: () => Promise<unknown>,
  words = where === 'map' || where === 'video' ? 'Not placed: ' : '',
): Promise<void> {
  return edit()
    .then(() => undefined)
    .catch((error: unknown) => state.refuse(where, `${words}${reasonOf(error)}`))
    .finally(() => state.changed());
}
