import type { Look } from '../scene/map_view';
import type { SurfaceState } from '../session/surface_book';

/** Why no surfaces are seen where they were asked for; empty: they are. */
export function surfaceWords(
  look: Look,
  { empty, failure }: { readonly empty: boolean; readonly failure: string },
  state: SurfaceState,
): string {
  if (look === 'dots' || !empty) return '';
  if (failure) return `no surfaces here, dots only: ${failure}`;
  if (state === 'not made') return 'this server makes no surfaces: dots only';
  return 'surfaces appear where the camera has moved sideways';
}
