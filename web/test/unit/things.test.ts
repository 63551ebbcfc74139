import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import * as THREE from 'three';
import { describe, expect, it } from 'vitest';
import { rotate, transform } from '../../src/geometry/rigid3';
import { cross, distance, dot, subtract, type Vec3, ZERO } from '../../src/geometry/vec3';
import { glbOf } from '../../src/tools/glb';
import {
  arrowOf,
  gridOf,
  pictureOf,
  pointingFrom,
  routeOf,
  tubeOf,
  wayFrom,
} from '../../src/tools/overlay_models';
import { DOWN, facing, roomOf } from '../../src/tools/thing_places';

const range = (corners: readonly Vec3[], axis: 'x' | 'y' | 'z'): [number, number] => {
  const values = corners.map((corner) => corner[axis]);
  return [Math.min(...values), Math.max(...values)];
};

/** Six times the volume, positive where triangles are counter-clockwise from outside. */
function volumeOf(corners: readonly Vec3[]): number {
  let sum = 0;
  for (let i = 0; i < corners.length; i += 3) {
    const [a = ZERO, b = ZERO, c = ZERO] = corners.slice(i, i + 3);
    sum += dot(a, cross(b, c));
  }
  return sum / 6;
}

describe('overlays', () => {
  const bend = [ZERO, { x: 1, y: 0, z: 0 }, { x: 1, y: -0.5, z: 0 }];

  it('a pipe goes along its way, as thick as it is', () => {
    const tube = tubeOf(bend, 0.03);
    expect(range(tube, 'x')[0]).toBeCloseTo(0, 6);
    expect(range(tube, 'z')[1]).toBeLessThan(0.036);
    expect(range(tube, 'y')[0]).toBeCloseTo(-0.5, 6);
    const straight = tubeOf(bend.slice(0, 2), 0.03);
    // A prism of twelve sides.
    expect(volumeOf(straight)).toBeCloseTo(6 * 0.03 ** 2 * Math.sin(Math.PI / 6), 9);
  });

  it('an arrow ends where it points, and is seen from outside', () => {
    const from = pointingFrom({ x: 0, y: 0, z: -1 }, 0.4);
    expect(distance(from, ZERO)).toBeCloseTo(0.4, 12);
    expect(from.y).toBeLessThan(0); // above
    expect(from.z).toBeLessThan(0); // before the wall
    const arrow = arrowOf(from, ZERO, 0.015);
    expect(volumeOf(arrow)).toBeGreaterThan(0);
    expect(Math.min(...arrow.map((corner) => distance(corner, ZERO)))).toBeLessThan(1e-9);
  });

  it('a grid has its lines, all seen from above', () => {
    const grid = gridOf(2, 1, 0.25);
    expect(grid.length).toBe(6 * (9 + 5));
    expect(range(grid, 'y')).toEqual([-0.004, -0.004]);
    expect(range(grid, 'x')[1]).toBeCloseTo(1.006, 9);
    for (let i = 0; i < grid.length; i += 3) {
      const [a = ZERO, b = ZERO, c = ZERO] = grid.slice(i, i + 3);
      expect(cross(subtract(b, a), subtract(c, a)).y).toBeLessThan(0);
    }
  });

  it('a route points the way it goes', () => {
    const way = [ZERO, { x: 2, y: 0, z: 0 }, { x: 2, y: 0, z: 1.5 }];
    const route = routeOf(way, 0.2);
    expect(route.length % 12).toBe(0);
    expect(route.length / 12).toBeGreaterThan(7);
    const tips = route.filter((_, i) => i % 12 === 0); // each head begins with its tip
    expect(tips[0]!.x).toBeCloseTo(0.21, 9);
    expect(tips.at(-1)!.z).toBeCloseTo(1.5 + 0.06, 9);
    expect(wayFrom([{ x: 1, y: 1, z: 1 }])).toBeUndefined();
    expect(wayFrom([{ x: 1, y: 1, z: 1 }, ZERO])?.offsets[1]).toEqual({ x: -1, y: -1, z: -1 });
  });

  it('a picture is its pixels; what is clear is left out', () => {
    const rgba = new Uint8ClampedArray([
      255, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0, 255, 0, 255, 0, 255,
    ]);
    const parts = pictureOf(rgba, 2, 1);
    expect(parts.map(({ corners }) => corners.length / 6)).toEqual([2, 1]);
    expect(parts[0]!.colour).toEqual([1, 0, 0]);
    expect(range(parts[0]!.corners, 'x')).toEqual([-0.5, 0]);
    expect(range(parts[0]!.corners, 'y')).toEqual([-0.5, 0.5]);
  });

  it('as a GLB file they are read again where they were, in their colours', async () => {
    const corners = arrowOf({ x: 0.1, y: -0.4, z: 0.2 }, ZERO, 0.015);
    const file = glbOf([{ colour: [0.75, 0.25, 0.5], corners }]);
    const { scene } = await new GLTFLoader().parseAsync(file.slice().buffer, '');
    const meshes: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>[] = [];
    scene.traverse((node) => {
      if (node instanceof THREE.Mesh) meshes.push(node as (typeof meshes)[0]);
    });
    expect(meshes.length).toBe(1);
    const at = meshes[0]!.geometry.getAttribute('position');
    expect(at.count).toBe(corners.length);
    corners.forEach((corner, i) => {
      expect(at.getX(i)).toBeCloseTo(corner.x, 6);
      expect(at.getY(i)).toBeCloseTo(-corner.y, 6);
      expect(at.getZ(i)).toBeCloseTo(-corner.z, 6);
    });
    expect(meshes[0]!.material.color.toArray()).toEqual([0.75, 0.25, 0.5]);
  });
});

describe('a room by six clicks', () => {
  const pose = { rotation: facing({ x: 0.5, y: 0, z: 0.8 }), translation: { x: 1, y: 1.2, z: -2 } };
  const at = (x: number, y: number, z: number): Vec3 => transform(pose, { x, y, z });
  const points = {
    floor: at(0.3, 0, -0.4),
    wall: [at(-1, -0.5, 1.5), at(0.7, -1.4, 1.5)] as const,
    sides: [at(-2, -0.8, 0.2), at(2, -1, -0.6)] as const,
    opposite: at(0.4, -1.1, -1.5),
  };

  it('is where they were clicked, whichever way round', () => {
    const [left, right] = points.sides;
    const [a, b] = points.wall;
    for (const clicked of [
      points,
      { ...points, sides: [right, left] as const, wall: [b, a] as const },
    ]) {
      const room = roomOf(clicked, 2.5);
      if (typeof room === 'string') throw new Error(room);
      expect(room.sizeM.x).toBeCloseTo(4, 9);
      expect(room.sizeM.y).toBe(2.5);
      expect(room.sizeM.z).toBeCloseTo(3, 9);
      expect(distance(room.pose.translation, pose.translation)).toBeLessThan(1e-9);
      const z = rotate(room.pose.rotation, { x: 0, y: 0, z: 1 });
      expect(dot(z, rotate(pose.rotation, { x: 0, y: 0, z: 1 }))).toBeCloseTo(1, 9);
      expect(rotate(room.pose.rotation, DOWN).y).toBeCloseTo(1, 12);
    }
  });

  it('is refused in words where walls would be one', () => {
    const above = [points.wall[0], { ...points.wall[0], y: 0 }] as const;
    expect(roomOf({ ...points, wall: above }, 2.5)).toMatch(/above each other/);
    expect(roomOf({ ...points, opposite: points.wall[0] }, 2.5)).toMatch(/0 mm apart/);
    expect(roomOf({ ...points, sides: [points.floor, points.floor] }, 2.5)).toMatch(/apart/);
  });
});
