import { largestSigma } from '../geometry/covariance';
import { fitPlane, intersect } from '../geometry/plane';
import {
  add,
  cross,
  dot,
  normalise,
  pixelDistance,
  type Pixel,
  scale,
  type Vec3,
} from '../geometry/vec3';
import { depthOf, eyeOf, projectPoint, rayOf, type View } from '../geometry/view';
import type { Feature, Target } from '../session/types';
import type { SurfaceHit } from './surface_rays';

/** Where a click would land, as far as this page can tell before the server decides. */
export interface Landing {
  readonly target: Target;
  /** The same where the server no longer keeps the frame that `target` names. */
  readonly later?: Target | undefined;
  readonly pointInWorld: Vec3;
  readonly sigmaM: number | undefined; // undefined: nothing known about the depth
  readonly depthM: number;
  /** Of the surface there, where one was seen. */
  readonly normalInWorld?: Vec3;
  readonly how: 'surface' | 'feature' | 'plane' | 'nearby depth' | 'unknown depth';
}

const FEATURE_PX = 20; // as the server's (slam-spec section 9): such a feature gives its depth
const SNAP_PX = 6; // in the map, a click this near to a feature means the feature itself
const NEAR_PX = 120;
const PLANE_RESIDUAL_M = 0.02;
const GUESSED_DEPTH_M = 1;

interface Seen {
  readonly feature: Feature;
  readonly pixel: Pixel;
  readonly depthM: number;
  readonly away: number; // from the click [px]
}

/** A click on the video: the pixel of the frame that is on the screen. */
export function landingInVideo(
  view: View,
  frameId: number,
  pixel: Pixel,
  features: Iterable<Feature>,
): Landing | undefined {
  const guess = guessAt(view, pixel, seenFrom(view, pixel, features));
  return guess && { ...guess, target: { kind: 'pixel', frameId, pixel } };
}

/** What the map shows beside marks, where it is clicked. */
export interface MapContent {
  /** Those that are drawn, or that are all there is. */
  readonly features: Iterable<Feature>;
  /** What of the place is drawn there. */
  readonly surface?: SurfaceHit | undefined;
}

const AGREE_SIGMA = 3;

/**
 * A click on the map, in the server's order (slam-spec section 9): the surface there, but for a feature that is
 * clicked itself and lies on it; else the ray into the scene. Nothing where only the depth of places elsewhere
 * could be guessed: in an empty corner nothing is to be seen.
 */
export function landingInMap(
  view: View,
  pixel: Pixel,
  { features, surface }: MapContent,
): Landing | undefined {
  const seen = seenFrom(view, pixel, features);
  const ray = rayThrough(view, pixel);
  const nearest = seen[0];
  if (!ray) return undefined;
  if (surface) {
    const onSurface = { ...ofSurface(view, surface), target: ray };
    if (!nearest || nearest.away > SNAP_PX) return onSurface;
    const apart = Math.abs(nearest.depthM - onSurface.depthM);
    if (apart > AGREE_SIGMA * Math.hypot(sigmaOf(nearest), surface.sigmaM)) return onSurface;
    return { ...onSurface, ...atFeature(nearest) };
  }
  const guess = guessAt(view, pixel, seen);
  if (!guess || !nearest) return undefined;
  const isGuessed = guess.how === 'nearby depth' || guess.how === 'unknown depth';
  if (isGuessed && nearest.away > NEAR_PX) return undefined;
  if (nearest.away <= SNAP_PX) {
    const { id, pointInWorld } = nearest.feature;
    return { ...guess, pointInWorld, target: { kind: 'feature', featureId: id } };
  }
  return { ...guess, target: ray };
}

const ofSurface = (view: View, surface: SurfaceHit): Omit<Landing, 'target'> => ({
  pointInWorld: surface.pointInWorld,
  sigmaM: surface.sigmaM,
  depthM: depthOf(view, surface.pointInWorld),
  normalInWorld: surface.normalInWorld,
  how: 'surface',
});

const atFeature = (seen: Seen): Omit<Landing, 'normalInWorld'> => ({
  target: { kind: 'feature', featureId: seen.feature.id },
  pointInWorld: seen.feature.pointInWorld,
  sigmaM: sigmaOf(seen),
  depthM: seen.depthM,
  how: 'feature',
});

type RayTarget = Extract<Target, { kind: 'ray' }>;

/** The ray of a pixel into the scene; undefined outside the lens. */
export function rayThrough(view: View, pixel: Pixel): RayTarget | undefined {
  const directionInWorld = rayOf(view, pixel);
  return directionInWorld && { kind: 'ray', originInWorld: eyeOf(view), directionInWorld };
}

/** Features in front of the eye, nearest to the click first. */
function seenFrom(view: View, click: Pixel, features: Iterable<Feature>): Seen[] {
  const seen: Seen[] = [];
  for (const feature of features) {
    if (!feature.depthKnown) continue;
    const pixel = projectPoint(view, feature.pointInWorld);
    if (!pixel) continue;
    const depthM = depthOf(view, feature.pointInWorld);
    seen.push({ feature, pixel, depthM, away: pixelDistance(pixel, click) });
  }
  return seen.sort((a, b) => a.away - b.away);
}

const sigmaOf = ({ feature }: Seen): number =>
  feature.covariance ? largestSigma(feature.covariance) : 0;

const median = (values: number[]): number =>
  values.sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? 0;

function guessAt(
  view: View,
  pixel: Pixel,
  seen: readonly Seen[],
): Omit<Landing, 'target'> | undefined {
  const direction = rayOf(view, pixel);
  if (!direction) return undefined;
  const nearest = seen[0];
  if (nearest && nearest.away <= FEATURE_PX) {
    const pointInWorld = pointAtDepth(view, direction, nearest.depthM);
    return { pointInWorld, sigmaM: sigmaOf(nearest), depthM: nearest.depthM, how: 'feature' };
  }
  return (
    onPlane(view, direction, seen) ??
    atDepth(view, direction, seen) ?? {
      pointInWorld: add(eyeOf(view), scale(direction, GUESSED_DEPTH_M)),
      sigmaM: undefined,
      depthM: GUESSED_DEPTH_M,
      how: 'unknown depth',
    }
  );
}

function onPlane(
  view: View,
  direction: Vec3,
  seen: readonly Seen[],
): Omit<Landing, 'target'> | undefined {
  const near = seen.filter(({ away }) => away <= NEAR_PX).slice(0, 6);
  const plane = fitPlane(near.map(({ feature }) => feature.pointInWorld));
  if (!plane || plane.residual > PLANE_RESIDUAL_M) return undefined;
  const point = intersect(plane, eyeOf(view), direction);
  if (!point) return undefined;
  const depthM = depthOf(view, point);
  const around = median(near.map((entry) => entry.depthM));
  if (!(depthM > around / 2 && depthM < around * 2)) return undefined; // seen too much edge-on
  // A slanted plane carries its error along the ray.
  const slant = Math.max(Math.abs(dot(direction, plane.normal)), 0.1);
  const sigmaM = Math.hypot(plane.residual, median(near.map(sigmaOf))) / slant;
  return { pointInWorld: point, sigmaM, depthM, normalInWorld: plane.normal, how: 'plane' };
}

function atDepth(
  view: View,
  direction: Vec3,
  seen: readonly Seen[],
): Omit<Landing, 'target'> | undefined {
  if (seen.length === 0) return undefined;
  const depthM = median(seen.slice(0, 12).map((entry) => entry.depthM));
  const pointInWorld = pointAtDepth(view, direction, depthM);
  return { pointInWorld, sigmaM: 0.3 * depthM, depthM, how: 'nearby depth' };
}

/** The point of a ray that is `depthM` in front of the eye. */
function pointAtDepth(view: View, direction: Vec3, depthM: number): Vec3 {
  const eye = eyeOf(view);
  return add(eye, scale(direction, depthM / depthOf(view, add(eye, direction))));
}

/** Radius [px] of the ring that stands for the uncertainty; undefined: unknown. */
export function ringRadius(view: View, landing: Landing): number | undefined {
  if (landing.sigmaM === undefined) return undefined;
  const { fx, fy } = view.camera.intrinsics;
  return (landing.sigmaM / landing.depthM) * ((fx + fy) / 2);
}

const RING_POINTS = 24;

/** The ring as it lies in the surface there, and a pin upright in its middle, `times` its size. */
export interface LyingRing {
  readonly rim: readonly Vec3[]; // closed
  readonly pin: readonly [Vec3, Vec3];
}

/** Undefined where no surface was seen. */
export function lyingRing(landing: Landing, times: number): LyingRing | undefined {
  const { pointInWorld: middle, normalInWorld: normal, sigmaM } = landing;
  if (landing.how !== 'surface' || !normal || sigmaM === undefined) return undefined;
  const { x, y, z } = normal;
  const a = normalise(Math.abs(y) < 0.9 ? { x: z, y: 0, z: -x } : { x: 0, y: -z, z: y });
  const b = cross(normal, a);
  const radius = times * sigmaM;
  const rim = Array.from({ length: RING_POINTS + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / RING_POINTS;
    const way = add(scale(a, Math.cos(angle)), scale(b, Math.sin(angle)));
    return add(middle, scale(way, radius));
  });
  return { rim, pin: [middle, add(middle, scale(normal, radius))] };
}

/** In words, for beside the ring; without scale in pixels, as there are no metres. */
export function landingWords(view: View, landing: Landing, metric: boolean): string {
  const { sigmaM, how } = landing;
  if (sigmaM === undefined) return 'depth unknown';
  const length =
    sigmaM < 0.0095 ? `${(sigmaM * 1000).toFixed(0)} mm` : `${(sigmaM * 100).toFixed(0)} cm`;
  const size = metric ? length : `${(ringRadius(view, landing) ?? 0).toFixed(0)} px`;
  return how === 'nearby depth' ? `±${size}, depth guessed` : `±${size}`;
}
