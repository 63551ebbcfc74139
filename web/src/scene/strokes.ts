import { projectPolyline } from '../geometry/polyline';
import { add, type Pixel, type Vec3 } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { type Annotation, doNotTrust, type Scale, type Shape } from '../session/types';
import { charactersOf } from './characters';

/** A polyline in pixels of a view, through its lens. */
export interface Stroke {
  readonly annotationId: string; // empty: the world's axes
  readonly points: readonly Pixel[];
  readonly colour: string; // CSS
  readonly hollow: boolean; // "do not trust", or not answered yet
}

export interface Label {
  readonly annotationId: string;
  /** At most 40 characters of it. */
  readonly text: string;
  /** All of it, for where there is room: the mark that is selected or pointed at. */
  readonly whole: string;
  readonly at: Pixel;
  readonly colour: string;
  readonly hollow: boolean;
}

export interface Marks {
  readonly strokes: Stroke[];
  readonly labels: Label[];
}

/** A mark to draw, answered by the server or not yet. */
export interface Mark {
  readonly id: string;
  readonly shape: Shape;
  readonly text: string;
  readonly sizeM: number;
  readonly pointInWorld: Vec3;
  readonly inkOffsetsM: readonly Vec3[];
  readonly colour: string;
  readonly hollow: boolean;
}

/** Its own colour as CSS; opaque, so that it can be seen, whatever the last byte is. */
export const colourOf = ({ colorRgba }: Pick<Annotation, 'colorRgba'>): string =>
  `#${(colorRgba >>> 8).toString(16).padStart(6, '0')}`;

/** Undefined where the annotation has no place in this map. */
export function markOf(annotation: Annotation, scale: Scale): Mark | undefined {
  const { anchor, id, shape, text, sizeM, inkOffsetsM } = annotation;
  if (!anchor.pointInWorld || anchor.state === 'stopped') return undefined;
  const colour = colourOf(annotation);
  const hollow = doNotTrust(anchor, scale);
  return { id, shape, text, sizeM, inkOffsetsM, colour, hollow, pointInWorld: anchor.pointInWorld };
}

const AXIS_M = 0.1;

/** Wire frame of a cube, axes parallel to world, its centre at the anchor: 12 edges. */
export function cubeEdges(centre: Vec3, sizeM: number): [Vec3, Vec3][] {
  const h = sizeM / 2;
  const corner = (i: number): Vec3 =>
    add(centre, { x: i & 1 ? h : -h, y: i & 2 ? h : -h, z: i & 4 ? h : -h });
  const edges: [Vec3, Vec3][] = [];
  for (let i = 0; i < 8; ++i) {
    for (const bit of [1, 2, 4]) {
      if (!(i & bit)) edges.push([corner(i), corner(i | bit)]);
    }
  }
  return edges;
}

/** An arrow in world whose tip is the anchor, pointing along +y (down where gravity is known). */
function arrowLines(tip: Vec3, sizeM: number): Vec3[][] {
  const up = (dx: number, dy: number, dz: number): Vec3 => add(tip, { x: dx, y: -dy, z: dz });
  const head = sizeM * 0.4;
  const half = head * 0.5;
  return [
    [up(0, 2 * sizeM, 0), tip],
    [up(-half, head, 0), tip, up(half, head, 0)],
    [up(0, head, -half), tip, up(0, head, half)],
  ];
}

function linesOf(mark: Mark): Vec3[][] {
  switch (mark.shape) {
    case 'cube':
      return cubeEdges(mark.pointInWorld, mark.sizeM);
    case 'note':
      return [[mark.pointInWorld, noteTop(mark)]];
    case 'arrow':
      return arrowLines(mark.pointInWorld, mark.sizeM);
    case 'ink':
      return [mark.inkOffsetsM.map((offset) => add(mark.pointInWorld, offset))];
  }
}

/** A note stands on a pin, one size above its anchor. */
const noteTop = (mark: Mark): Vec3 => add(mark.pointInWorld, { x: 0, y: -mark.sizeM, z: 0 });

/** All marks as they appear in a view. What cannot be projected leaves a gap. */
export function strokesOf(view: View, marks: readonly Mark[]): Marks {
  const strokes: Stroke[] = [];
  const labels: Label[] = [];
  for (const mark of marks) {
    for (const line of linesOf(mark)) {
      for (const points of projectPolyline(view.camera, view.cameraFromWorld, line)) {
        strokes.push({ annotationId: mark.id, points, colour: mark.colour, hollow: mark.hollow });
      }
    }
    const at = projectPoint(view, mark.shape === 'note' ? noteTop(mark) : mark.pointInWorld);
    if (!at || !view.camera.inImage(at, -32)) continue;
    const text = labelOf(mark, shorten);
    if (!text) continue;
    const { id: annotationId, colour, hollow } = mark;
    labels.push({ annotationId, text, whole: labelOf(mark, oneLine), at, colour, hollow });
  }
  return { strokes, labels };
}

function labelOf(mark: Mark, cut: (text: string) => string): string {
  const words = mark.shape === 'note' || mark.text ? cut(mark.text || 'note') : '';
  if (!mark.hollow) return words;
  return mark.id === '' ? words : [words, 'do not trust'].filter(Boolean).join(': ');
}

const oneLine = (text: string): string => text.replace(/[\n\r\t]/g, ' ');

const MAX_LABEL = 40; // characters

/** Between characters as people count them: never within an emoji or an accented letter. */
function shorten(text: string): string {
  const characters = charactersOf(oneLine(text));
  if (characters.length <= MAX_LABEL) return characters.join('');
  return `${characters.slice(0, MAX_LABEL - 1).join('')}…`;
}

export interface AxisStroke {
  readonly name: 'x' | 'y' | 'z';
  readonly pieces: Pixel[][];
  readonly end: Pixel | undefined;
}

/** The world's three axes, 10 cm long, at its origin. */
export function axisStrokes(view: View): AxisStroke[] {
  const origin = { x: 0, y: 0, z: 0 };
  return (['x', 'y', 'z'] as const).map((name) => {
    const tip = { ...origin, [name]: AXIS_M };
    return {
      name,
      pieces: projectPolyline(view.camera, view.cameraFromWorld, [origin, tip]),
      end: projectPoint(view, tip),
    };
  });
}
