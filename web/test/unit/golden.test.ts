// The page's drawing against tests/golden/overlay_strokes.json, which the server's is held against
// as well (tests/unit/server/overlay/golden_test.cpp).
import { readFileSync } from 'node:fs';
import { describe, expect, it } from 'vitest';
import { Camera, type Intrinsics } from '../../src/geometry/camera';
import type { Pixel } from '../../src/geometry/vec3';
import { makeView } from '../../src/geometry/view';
import { edgeArrowsOf } from '../../src/scene/edge_arrows';
import { axisStrokes, markOf, strokesOf } from '../../src/scene/strokes';
import type { AnchorState, Annotation, Shape } from '../../src/session/types';
import { PLAIN } from './annotations';

type Pair = [number, number];
type Triple = [number, number, number];
interface Drawn {
  annotation_id: string;
  hollow: boolean;
  colour: string;
}
interface Golden {
  tolerance_px: number;
  annotations: {
    id: string;
    shape: Shape;
    text: string;
    size_m: number;
    color_rgba: number;
    state: AnchorState;
    error_mm?: number;
    error_px?: number;
    point_in_world_m: Triple;
    ink_offset_m: Triple[];
    world_from_mark?: [number, number, number, number];
    extent_m?: Triple;
    number?: number;
    length_m?: number;
    length_sigma_m?: number;
    picture?: { width: number; height: number };
    check_items?: { text: string; done: boolean }[];
  }[];
  views: {
    camera: Intrinsics;
    world_from_camera: { translation_m: Triple; rotation_xyzw: [number, number, number, number] };
    strokes: (Drawn & { points_px: Pair[] })[];
    labels: (Drawn & { text: string; at_px: Pair })[];
    edge_arrows: (Drawn & { tip_px: Pair; direction: Pair })[];
    axes: { name: string; pieces_px: Pair[][] }[];
  }[];
}

const file = new URL('../../../tests/golden/overlay_strokes.json', import.meta.url);
const golden = JSON.parse(readFileSync(file, 'utf8')) as Golden;

const vec3 = ([x, y, z]: Triple) => ({ x, y, z });
const pair = ({ u, v }: Pixel): Pair => [u, v];
const drawn = (mark: { annotationId: string; hollow: boolean; colour: string }): Drawn => ({
  annotation_id: mark.annotationId,
  hollow: mark.hollow,
  colour: mark.colour,
});

const marks = golden.annotations.map((entry) => {
  const [x = 0, y = 0, z = 0, w = 1] = entry.world_from_mark ?? [];
  const annotation: Annotation = {
    ...PLAIN,
    worldFromMark: entry.world_from_mark && { x, y, z, w },
    extentM: entry.extent_m && vec3(entry.extent_m),
    number: entry.number ?? 0,
    lengthM: entry.length_m ?? 0,
    lengthSigmaM: entry.length_sigma_m ?? 0,
    picture: entry.picture && { ...entry.picture, sha256: '' },
    checkItems: (entry.check_items ?? []).map((item) => ({ ...item, doneBy: '' })),
    id: entry.id,
    shape: entry.shape,
    text: entry.text,
    author: '',
    sizeM: entry.size_m,
    colorRgba: entry.color_rgba,
    createdMs: 0,
    inkOffsetsM: entry.ink_offset_m.map(vec3),
    anchor: {
      state: entry.state,
      pointInWorld: vec3(entry.point_in_world_m),
      covariance: undefined,
      errorMm: entry.error_mm ?? 0,
      errorPx: entry.error_px,
      reason: '',
    },
  };
  return markOf(annotation, { metric: true, eye: undefined })!;
});

/** A label may be cut on either side: then one begins as the other does. */
function sameWords(actual: string, expected: string): boolean {
  const [short, long] = actual.length < expected.length ? [actual, expected] : [expected, actual];
  const [begin = '', rest = ''] = short.split('…');
  return (
    actual === expected || (short.includes('…') && long.startsWith(begin) && long.endsWith(rest))
  );
}

/** Numbers within the tolerance, everything else equal; what only the server draws is left out. */
function compare(actual: unknown, expected: unknown, where: string): void {
  if (typeof expected === 'number' && typeof actual === 'number') {
    expect(Math.abs(actual - expected), where).toBeLessThanOrEqual(golden.tolerance_px);
  } else if (typeof expected === 'object' && expected !== null) {
    expect(typeof actual, where).toBe('object');
    const [a, e] = [actual as Record<string, unknown>, expected as Record<string, unknown>];
    if (Array.isArray(expected)) expect(Object.keys(a), where).toEqual(Object.keys(e));
    for (const key of Object.keys(a)) compare(a[key], e[key], `${where}/${key}`);
  } else if (where.endsWith('/text')) {
    expect(sameWords(String(actual), String(expected)), `${where}: ${String(actual)}`).toBe(true);
  } else {
    expect(actual, where).toBe(expected);
  }
}

describe('the page draws what the server draws', () => {
  it.each(golden.views.map((view, i) => ({ i, model: view.camera.model, expected: view })))(
    'view $i, $model',
    ({ expected }) => {
      const { translation_m, rotation_xyzw } = expected.world_from_camera;
      const [x, y, z, w] = rotation_xyzw;
      const view = makeView(new Camera(expected.camera), {
        translation: vec3(translation_m),
        rotation: { x, y, z, w },
      });
      const { strokes, labels } = strokesOf(view, marks);
      compare(
        strokes.map((stroke) => ({ ...drawn(stroke), points_px: stroke.points.map(pair) })),
        expected.strokes,
        'strokes',
      );
      compare(
        labels.map((label) => ({ ...drawn(label), text: label.text, at_px: pair(label.at) })),
        expected.labels,
        'labels',
      );
      compare(
        edgeArrowsOf(view, marks).map((arrow) => ({
          ...drawn(arrow),
          tip_px: pair(arrow.tip),
          direction: pair(arrow.direction),
        })),
        expected.edge_arrows,
        'edge arrows',
      );
      compare(
        axisStrokes(view).map(({ name, pieces }) => ({
          name,
          pieces_px: pieces.map((piece) => piece.map(pair)),
        })),
        expected.axes,
        'axes',
      );
    },
  );

  it('holds colours, hollow marks and arrows, so that they are compared at all', () => {
    const all = golden.views.flatMap((view) => [...view.strokes, ...view.edge_arrows]);
    expect(new Set(all.map(({ colour }) => colour)).size).toBeGreaterThan(2);
    expect(all.some(({ hollow }) => hollow)).toBe(true);
    expect(golden.views.some((view) => view.edge_arrows.length > 1)).toBe(true);
  });
});
