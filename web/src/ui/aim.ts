import { pixelDistance, type Pixel } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { labelPoint, measureEnd } from '../scene/shapes';
import { type Mark, strokesOf } from '../scene/strokes';
import type { Session } from '../session/session';
import { type Annotation, isPlaced, type Target } from '../session/types';
import { distanceFromPiece } from '../tools/ink';
import { type Landing, landingInMap, landingInVideo, rayThrough } from '../tools/landing';
import type { AppState, PaneName } from './app_state';
import type { MapPane } from './map_pane';
import type { VideoPane } from './video_pane';

const PICK_PX = 22; // CSS px: a fingertip's half
const PICK_LINE_PX = 7;

/** What is under a place of the page. */
export class Aim {
  constructor(
    private readonly session: Session,
    private readonly state: AppState,
    readonly map: MapPane,
    readonly video: VideoPane,
  ) {}

  /** In the pane's view; of the video undefined outside the picture. */
  pixelAt(pane: PaneName, clientX: number, clientY: number): Pixel | undefined {
    return (pane === 'map' ? this.map : this.video).pixelAt(clientX, clientY);
  }

  /** The same; beside the video's picture, the nearest of its pixels. */
  pixelNear(pane: PaneName, clientX: number, clientY: number): Pixel {
    return pane === 'map'
      ? this.map.pixelAt(clientX, clientY)
      : this.video.pixelNear(clientX, clientY);
  }

  view(pane: PaneName): View | undefined {
    return (pane === 'map' ? this.map : this.video).view();
  }

  /** CSS pixels of the page for one of the pane's view. */
  scale(pane: PaneName): number {
    return pane === 'map' ? 1 : this.video.scale;
  }

  /** Where the keyboard clicks, in pixels of the page: the middle of the map, the cursor in the video. */
  keyPlace(pane: PaneName): { x: number; y: number } {
    if (pane === 'video') {
      const { x, y } = this.state.cursor ?? { x: 0.5, y: 0.5 };
      return this.video.placeAt(x, y);
    }
    const box = this.map.element.getBoundingClientRect();
    return { x: box.left + box.width / 2, y: box.top + box.height / 2 };
  }

  /** `late`: it is asked for some time after the click. */
  landing(pane: PaneName, pixel: Pixel, late = false): Landing | undefined {
    if (pane === 'map') {
      const view = this.map.view();
      return view && landingInMap(view, pixel, this.map.contentAt(view, pixel));
    }
    const current = this.video.current();
    if (!current?.view) return undefined;
    const features = this.session.map.features.values();
    const landing = landingInVideo(current.view, current.facts.frameId, pixel, features);
    // A frozen picture is clicked late, a note is placed when its text is done.
    if (!landing || !(late || this.video.frozen) || !this.video.sameMap) return landing;
    return { ...landing, later: rayThrough(current.view, pixel) };
  }

  /** What a pixel means to the server, without a guess of where that is. */
  target(pane: PaneName, pixel: Pixel): Target | undefined {
    const view = this.view(pane);
    if (!view) return undefined;
    const frameId = pane === 'video' ? this.video.current()?.facts.frameId : undefined;
    return frameId === undefined ? rayThrough(view, pixel) : { kind: 'pixel', frameId, pixel };
  }

  /** The mark whose anchor, label or line is there. */
  pick(pane: PaneName, pixel: Pixel): Annotation | undefined {
    const view = this.view(pane);
    if (!view) return undefined;
    const marks = (pane === 'map' ? this.map : this.video).marks();
    const scale = this.scale(pane);
    const id = nearestMark(view, pixel, marks, scale) ?? nearestLine(view, pixel, marks, scale);
    return id === undefined ? undefined : this.session.annotations.get(id);
  }

  whyNoLanding(pane: PaneName): string {
    if (pane === 'map') {
      return this.map.view() ? 'nothing is mapped there.' : 'the map is not shown yet.';
    }
    const current = this.video.current();
    if (!current) return 'there is no picture yet.';
    const placed = isPlaced(current.facts.pose);
    return placed ? 'that is outside the picture.' : 'where the camera is is not known now.';
  }
}

function nearestMark(
  view: View,
  pixel: Pixel,
  marks: readonly Mark[],
  scale: number,
): string | undefined {
  let best: string | undefined;
  let bestAway = PICK_PX / scale;
  for (const mark of marks) {
    if (mark.id === '') continue;
    const ends = [mark.pointInWorld, labelPoint(mark)];
    if (mark.shape === 'measure') ends.push(measureEnd(mark));
    for (const end of ends) {
      const at = projectPoint(view, end);
      const away = at ? pixelDistance(at, pixel) : Infinity;
      if (away <= bestAway) [best, bestAway] = [mark.id, away];
    }
  }
  return best;
}

function nearestLine(
  view: View,
  pixel: Pixel,
  marks: readonly Mark[],
  scale: number,
): string | undefined {
  let best: string | undefined;
  let bestAway = PICK_LINE_PX / scale;
  for (const { annotationId, points } of strokesOf(view, marks).strokes) {
    if (annotationId === '') continue;
    for (let i = 1; i < points.length; ++i) {
      const away = distanceFromPiece(pixel, points[i - 1], points[i]);
      if (away <= bestAway) [best, bestAway] = [annotationId, away];
    }
  }
  return best;
}
