import { IDENTITY, type Rigid3 } from '../geometry/rigid3';
import { add, distance, scale, type Vec3 } from '../geometry/vec3';
import type { Material } from '../session/scene_book';
import type { Session } from '../session/session';
import { glbOf } from '../tools/glb';
import {
  arrowOf,
  gridOf,
  type Part,
  pictureOf,
  pointingFrom,
  routeOf,
  tubeOf,
  wayFrom,
} from '../tools/overlay_models';
import { DOWN, facing } from '../tools/thing_places';
import type { Hit } from '../tools/thing_rays';
import { ThingPoints } from './thing_points';

/** What is laid over a room to explain it. */
export type OverlayKind = 'grid' | 'route' | 'pipe' | 'wire' | 'pointer';
export const OVERLAYS: readonly [OverlayKind, string][] = [
  ['grid', 'lays a grid on a floor: 1 point'],
  ['route', 'marks a way: points, then Done'],
  ['pipe', 'shows a pipe in a wall: points, then Done'],
  ['wire', 'shows a wire in a wall: points, then Done'],
  ['pointer', 'lets an arrow point there: 1 point'],
];
export const isOverlay = (does: string): does is OverlayKind =>
  OVERLAYS.some(([kind]) => kind === does);

/** A thing that is not there yet, and the GLB file of its model. */
export interface Overlay {
  readonly name: string;
  readonly material: Material;
  readonly file: Uint8Array;
  readonly pose: Rigid3;
}

/** Where a click landed, and out of what. */
export interface OverlayPoint {
  readonly pointInWorld: Vec3;
  readonly normalInWorld: Vec3; // unit, towards who looks
  readonly hit: Hit | undefined; // a known surface
}

const COLOURS: Record<OverlayKind, Part['colour']> = {
  grid: [0.55, 0.6, 0.65],
  route: [0.02, 0.45, 0.15],
  pipe: [0.05, 0.2, 0.6],
  wire: [0.75, 0.35, 0.02],
  pointer: [0.75, 0.03, 0.02],
};
const GRID_STEP_M = 0.25;
const GRID_M = 3; // where no surface is known
const MOST_GRID_M = 20;
const ROUTE_M = 0.18;
const INSIDE_M = 0.05; // how deep pipes and wires lie in their wall
const RADIUS_M = { pipe: 0.025, wire: 0.008 } as const;
const POINTER_M = { length: 0.4, radius: 0.015 } as const;
const AGAIN_M = 0.03; // a click on the last point ends a way
const PICTURE_PX = 64;

const at = (translation: Vec3): Rigid3 => ({ ...IDENTITY, translation });

/** Overlays by clicks: grid and arrow by one, routes, pipes and wires by as many as they have bends. */
export class ThingOverlays {
  private readonly points: ThingPoints;
  private readonly normals: Vec3[] = [];

  constructor(session: Session, colour: () => number) {
    this.points = new ThingPoints(session, colour);
  }

  get begun(): boolean {
    return this.points.inWorld.length > 0;
  }

  cancel(): void {
    this.points.clear();
    this.normals.length = 0;
  }

  hint(kind: OverlayKind): string {
    const clicked = this.points.inWorld.length;
    if (kind === 'grid') return 'Click the floor that the grid is to lie on.';
    if (kind === 'pointer') return 'Click what the arrow is to point at.';
    const where = kind === 'route' ? 'the way on the floor' : 'the wall along it';
    if (clicked < 2) return `Point ${clicked + 1}: click ${where}.`;
    return `Point ${clicked + 1}: click ${where}; the last point again, or Done, ends it.`;
  }

  /** Undefined: more points are wanted. */
  click(kind: OverlayKind, point: OverlayPoint): Overlay | undefined {
    if (kind === 'grid') return gridAt(point);
    if (kind === 'pointer') return pointerAt(point);
    const last = this.points.inWorld.at(-1);
    if (last && distance(last, point.pointInWorld) < AGAIN_M) return this.finish(kind);
    this.points.add(point.pointInWorld);
    this.normals.push(point.normalInWorld);
    return undefined;
  }

  /** What was clicked so far. Throws, in words, where that is nothing yet. */
  finish(kind: OverlayKind): Overlay {
    const inside = kind === 'route' ? 0 : INSIDE_M;
    const way = wayFrom(
      this.points.inWorld.map((point, i) => add(point, scale(this.normals[i] ?? DOWN, -inside))),
    );
    if (!way) throw new Error('click two points at least, apart from each other');
    this.cancel();
    const corners =
      kind === 'route'
        ? routeOf(way.offsets, ROUTE_M)
        : tubeOf(way.offsets, RADIUS_M[kind === 'pipe' ? 'pipe' : 'wire']);
    const material = kind === 'route' ? 'guide' : 'hidden';
    return { name: kind, material, file: fileOf(kind, corners), pose: at(way.first) };
  }
}

const fileOf = (kind: OverlayKind, corners: readonly Vec3[]): Uint8Array =>
  glbOf([{ colour: COLOURS[kind], corners }]);

/** Over all of the floor, plane or box top that was clicked; else a field about the point. */
function gridAt({ pointInWorld, hit }: OverlayPoint): Overlay {
  const flat = hit && Math.abs(hit.normalInWorld.y) > 0.9 ? hit.thing : undefined;
  const size = (m: number | undefined): number => Math.min(m ?? GRID_M, MOST_GRID_M);
  const file = fileOf('grid', gridOf(size(flat?.sizeM.x), size(flat?.sizeM.z), GRID_STEP_M));
  const pose = flat
    ? {
        rotation: flat.parentFromObject.rotation,
        translation: { ...flat.parentFromObject.translation, y: pointInWorld.y },
      }
    : at(pointInWorld);
  return { name: 'grid', material: 'guide', file, pose };
}

function pointerAt({ pointInWorld, normalInWorld }: OverlayPoint): Overlay {
  const from = pointingFrom(normalInWorld, POINTER_M.length);
  const file = fileOf('pointer', arrowOf(from, { x: 0, y: 0, z: 0 }, POINTER_M.radius));
  return { name: 'pointer', material: 'guide', file, pose: at(pointInWorld) };
}

/** Where something hangs that shows what is behind a surface: its own z axis goes in. */
export const behind = ({ pointInWorld, normalInWorld }: OverlayPoint): Rigid3 => ({
  rotation: facing(scale(normalInWorld, -1)),
  translation: pointInWorld,
});

/** A picture file as a model that shows it, `widthM` wide, its middle at the origin. */
export async function pictureModel(file: File, widthM: number): Promise<Uint8Array> {
  const bitmap = await createImageBitmap(file);
  const share = PICTURE_PX / Math.max(bitmap.width, bitmap.height);
  const [columns, rows] = [bitmap.width, bitmap.height].map((px) =>
    Math.max(1, Math.round(px * share)),
  ) as [number, number];
  const canvas = new OffscreenCanvas(columns, rows);
  const context = canvas.getContext('2d');
  if (!context) throw new Error('this browser cannot read the picture');
  context.drawImage(bitmap, 0, 0, columns, rows);
  const { data } = context.getImageData(0, 0, columns, rows);
  return glbOf(pictureOf(data, columns, widthM));
}
