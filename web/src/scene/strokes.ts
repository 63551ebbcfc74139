import { projectPolyline } from '../geometry/polyline';
import { type Rigid3, transform } from '../geometry/rigid3';
import { type Pixel, type Vec3 } from '../geometry/vec3';
import { projectPoint, type View } from '../geometry/view';
import { type Annotation, doNotTrust, type MarkForm, type Scale } from '../session/types';
import { charactersOf } from './characters';
import { markWords } from './label_words';
import { labelPoint, linesOf, pictureOutline, reachOf } from './shapes';

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
export interface Mark extends Omit<MarkForm, 'colorRgba' | 'picture'> {
  readonly id: string;
  readonly author: string;
  readonly pointInWorld: Vec3;
  readonly colour: string;
  readonly hollow: boolean;
  /** What its label says, without "do not trust". */
  readonly words: string;
  /** PICTURE: height over width. */
  readonly aspect: number;
}

/** Its own colour as CSS; opaque, so that it can be seen, whatever the last byte is. */
export const colourOf = ({ colorRgba }: Pick<Annotation, 'colorRgba'>): string =>
  `#${(colorRgba >>> 8).toString(16).padStart(6, '0')}`;

/** Undefined where the annotation has no place in this map. */
export function markOf(annotation: Annotation, scale: Scale): Mark | undefined {
  const { anchor, id, author } = annotation;
  if (!anchor.pointInWorld || anchor.state === 'stopped') return undefined;
  const hollow = doNotTrust(anchor, scale);
  return makeMark(annotation, { id, author, pointInWorld: anchor.pointInWorld, hollow }, scale);
}

export function makeMark(
  form: MarkForm,
  where: Pick<Mark, 'id' | 'author' | 'pointInWorld' | 'hollow'>,
  { metric }: Scale,
): Mark {
  const { shape, text, sizeM, inkOffsetsM, worldFromMark, extentM } = form;
  const { number, lengthM, lengthSigmaM, checkItems, picture } = form;
  return {
    ...where,
    ...{ shape, text, sizeM, inkOffsetsM, worldFromMark, extentM },
    ...{ number, lengthM, lengthSigmaM, checkItems },
    colour: colourOf(form),
    words: markWords(form, metric),
    aspect: picture && picture.width > 0 ? picture.height / picture.width : 1,
  };
}

const AXIS_M = 0.1;

/** True where nothing of it can be in front of the eye. */
const isBehind = (mark: Mark, cameraFromWorld: Rigid3): boolean =>
  transform(cameraFromWorld, mark.pointInWorld).z < -reachOf(mark);

/**
 * All marks as they appear in a view. What cannot be projected leaves a gap. `named`: those whose label
 * says who made them, even where they say nothing else.
 */
export function strokesOf(
  view: View,
  marks: readonly Mark[],
  named: readonly (string | undefined)[] = [],
): Marks {
  const strokes: Stroke[] = [];
  const labels: Label[] = [];
  for (const mark of marks) {
    if (isBehind(mark, view.cameraFromWorld)) continue;
    const { id: annotationId, colour, hollow } = mark;
    for (const line of linesOf(mark, view)) {
      for (const points of projectPolyline(view.camera, view.cameraFromWorld, line)) {
        strokes.push({ annotationId, points, colour, hollow });
      }
    }
    const by = named.includes(annotationId) ? mark.author : '';
    if (!by && !mark.words && !hollow) continue;
    const at = projectPoint(view, labelPoint(mark));
    if (!at || !view.camera.inImage(at, -32)) continue;
    const text = labelOf(mark, shorten(mark.words));
    const whole = [labelOf(mark, plainLines(mark.words)), by].filter(Boolean).join(' · ');
    if (text || whole)
      labels.push({ annotationId, text: text || whole, whole, at, colour, hollow });
  }
  return { strokes, labels };
}

function labelOf(mark: Mark, words: string): string {
  if (!mark.hollow) return words;
  return mark.id === '' ? words : [words, 'do not trust'].filter(Boolean).join(': ');
}

const plainLines = (text: string): string => text.replace(/[\r\t]/g, ' ');

const MAX_LABEL = 40; // characters
const shortened = new Map<string, string>();

/** The first line, cut between characters as people count them: never within an emoji or an accented letter. */
function shorten(text: string): string {
  if (text.length <= MAX_LABEL && !/[\n\r\t]/.test(text)) return text;
  let short = shortened.get(text);
  if (short === undefined) {
    if (shortened.size > 500) shortened.clear();
    const [first = '', ...rest] = text.split('\n');
    const characters = charactersOf(plainLines(first));
    const cut = characters.length > MAX_LABEL || rest.length > 0;
    short = `${characters.slice(0, MAX_LABEL - 1).join('')}${cut ? '…' : ''}`;
    shortened.set(text, short);
  }
  return short;
}

/** A picture as it appears: rows of its grid from the top left, each point undefined where the lens ends. */
export function pictureGrid(view: View, mark: Mark, steps: number): (Pixel | undefined)[][] {
  const [lowerLeft, lowerRight, , upperLeft] = pictureOutline(mark, view);
  if (!lowerLeft || !lowerRight || !upperLeft) return [];
  const at = (across: number, down: number): Vec3 => ({
    x: upperLeft.x + (lowerRight.x - lowerLeft.x) * across,
    y: upperLeft.y + (lowerLeft.y - upperLeft.y) * down,
    z: upperLeft.z + (lowerRight.z - lowerLeft.z) * across,
  });
  const shares = Array.from({ length: steps + 1 }, (_, i) => i / steps);
  return shares.map((down) => shares.map((across) => projectPoint(view, at(across, down))));
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
