import { create } from '@bufbuild/protobuf';
import { describe, expect, it } from 'vitest';
import { Camera } from '../../src/geometry/camera';
import { clipFromEye, pinholeAround } from '../../src/geometry/pinhole';
import {
  GetModelResponseSchema,
  SceneEventSchema,
  SceneMaterial,
  SceneShape,
} from '../../src/gen/saccade/v1/scene_pb';
import { IDENTITY, rotate, transform } from '../../src/geometry/rigid3';
import { distance, ZERO } from '../../src/geometry/vec3';
import { type ModelCalls, SceneBook, type Thing } from '../../src/session/scene_book';
import { beforeWall, boxOf, facing, planeOf, turnDeg } from '../../src/tools/thing_places';
import { cornersOf, hitSurface, pickThing } from '../../src/tools/thing_rays';
import { contactShadows } from '../../src/scene/contact_shadow';
import { worldFromThing } from '../../src/session/thing_place';

const LENS = new Camera({
  model: 'brown_conrady',
  ...{ width: 640, height: 480, fx: 500, fy: 505, cx: 322, cy: 238 },
  distortion: [-0.28, 0.07, 0.0002, 0.0001, 0],
});

describe('the pinhole camera around a lens', () => {
  it('shows every pixel of the picture', () => {
    const pinhole = pinholeAround(LENS);
    for (let u = 0; u < 640; u += 9) {
      for (let v = 0; v < 480; v += 7) {
        const at = pinhole.project(LENS.unproject({ u, v })!);
        expect(at && pinhole.inImage(at, 1)).toBe(true);
      }
    }
  });

  it('is what OpenGL projects by', () => {
    const rows = clipFromEye(LENS, 0.03, 200);
    const point = { x: 0.3, y: -0.2, z: 1.7 }; // ours; the eye's is y up, z backward
    const eye = [point.x, -point.y, -point.z, 1];
    const clip = [0, 1, 2, 3].map((row) =>
      eye.reduce((sum, value, column) => sum + rows[4 * row + column]! * value, 0),
    );
    const u = ((clip[0]! / clip[3]! + 1) / 2) * 640 - 0.5;
    const v = ((1 - clip[1]! / clip[3]!) / 2) * 480 - 0.5;
    expect(u).toBeCloseTo((500 * 0.3) / 1.7 + 322, 9);
    expect(v).toBeCloseTo((505 * -0.2) / 1.7 + 238, 9);
    expect(clip[3]).toBeCloseTo(1.7, 12);
    const near = rows[10]! * -0.03 + rows[11]!;
    expect(near / 0.03).toBeCloseTo(-1, 9);
  });
});

describe('the book of the scene', () => {
  const calls = (data: Uint8Array, log: string[]): ModelCalls => ({
    getModel: ({ offsetBytes }) => {
      log.push(`model ${offsetBytes}`);
      return Promise.resolve(
        create(GetModelResponseSchema, {
          totalBytes: 5,
          data: data.slice(offsetBytes, offsetBytes + 3),
        }),
      );
    },
  });
  const shelf = { id: 'a', name: 'shelf', modelId: 'm', scale: 0 };
  const kinds = { shape: SceneShape.MODEL, material: SceneMaterial.VIRTUAL };
  const settled = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 5));

  it('has all of it first, then what changed; a model is fetched once, in pieces', async () => {
    const book = new SceneBook();
    const log: string[] = [];
    const server = calls(new Uint8Array([1, 2, 3, 4, 5]), log);
    const first = {
      ...{ revision: 3n, full: true, upserted: [{ ...shelf, ...kinds }] },
      addedModels: [{ id: 'm', name: 'shelf', bytes: 5 }],
    };
    book.apply(create(SceneEventSchema, first), server, 's');
    await settled();
    const second = {
      revision: 4n,
      upserted: [
        { ...shelf, ...kinds, name: 'rack' },
        { id: 'b', name: 'box', shape: SceneShape.BOX },
      ],
    };
    book.apply(create(SceneEventSchema, second), server, 's');
    await settled();
    expect(log).toEqual(['model 0', 'model 3']);
    expect([...book.files.get('m')!]).toEqual([1, 2, 3, 4, 5]);
    expect(book.things.map(({ name }) => name)).toEqual(['rack', 'box']);
    expect(book.things[0]).toMatchObject({ material: 'virtual', scale: 1 });
    book.apply(create(SceneEventSchema, { revision: 5n, removedIds: ['a'] }), server, 's');
    expect(book.things.map(({ name }) => name)).toEqual(['box']);
    book.apply(create(SceneEventSchema, { revision: 1n, full: true }), server, 's');
    expect(book.things).toEqual([]);
  });

  it('tries again, with the next change, what came torn', async () => {
    const book = new SceneBook();
    const log: string[] = [];
    const model = { id: 'm', name: 'shelf', bytes: 5 };
    const event = create(SceneEventSchema, { full: true, addedModels: [model] });
    book.apply(event, calls(new Uint8Array([1, 2]), log), 's');
    await settled();
    expect(book.files.size).toBe(0);
    const whole = calls(new Uint8Array([1, 2, 3, 4, 5]), log);
    book.apply(create(SceneEventSchema, { revision: 2n }), whole, 's');
    await settled();
    expect(book.files.get('m')!.length).toBe(5);
  });
});

const thing = (more: Partial<Thing>): Thing => ({
  ...{ id: 'r', name: 'room', shape: 'room', material: 'real', modelId: '', scale: 1 },
  ...{ sizeM: { x: 4, y: 2.5, z: 4 }, annotationId: '', marker: undefined, colorRgba: 0 },
  ...{ parentFromObject: IDENTITY, ...more },
});

describe('where things come to stand', () => {
  const room = thing({});
  const box = thing({ id: 'b', shape: 'box', sizeM: { x: 1, y: 0.7, z: 0.6 } });

  it('a sight meets the nearest surface: a room from inside, a box from outside', () => {
    const ray = {
      originInWorld: { x: 0, y: -1.5, z: -1.5 },
      directionInWorld: { x: 0, y: 0.8, z: 1.2 },
    };
    const hit = hitSurface([room, box], ray)!;
    expect(hit.thing.id).toBe('b');
    expect(hit.pointInWorld.y).toBeCloseTo(-0.7, 9);
    expect(hit.normalInWorld).toEqual({ x: 0, y: -1, z: 0 });
    const wall = hitSurface([room], { ...ray, directionInWorld: { x: 1, y: 0, z: 0 } })!;
    expect(wall.pointInWorld).toEqual({ x: 2, y: -1.5, z: -1.5 });
    expect(wall.normalInWorld.x).toBe(-1);
    expect(pickThing([room, box], [], ray)?.id).toBe('b');
    const up = { ...ray, originInWorld: { x: 9, y: 9, z: 9 } };
    expect(hitSurface([room, box], up)).toBeUndefined();
  });

  it('before a wall it has its back to it, and is pushed into it', () => {
    const { start, push } = beforeWall(
      { x: 2, y: -1, z: 0.5 },
      { x: -1, y: 0, z: 0 },
      { x: 1, y: 0.2, z: 0 },
      0.4,
      0,
    );
    expect(push.x).toBeCloseTo(1, 12);
    expect(start.translation.x).toBeCloseTo(2 - 0.2 - 0.3, 9);
    expect(start.translation.y).toBeCloseTo(-0.05, 9);
    expect(turnDeg(start)).toBeCloseTo(90, 9);
  });

  it('a plane lies through three points and faces the eye', () => {
    const made = planeOf(
      { x: 0, y: -1, z: 1 },
      { x: 2, y: -1, z: 1 },
      { x: 0.5, y: -2, z: 1 },
      { x: 0, y: -1, z: -3 },
    );
    if (typeof made === 'string') throw new Error(made);
    expect(made.sizeM.x).toBeCloseTo(2, 9);
    expect(made.sizeM.z).toBeCloseTo(1, 9);
    const { pose } = made;
    const up = rotate(pose.rotation, { x: 0, y: -1, z: 0 });
    expect(up.z).toBeCloseTo(-1, 9);
    for (const corner of cornersOf(thing({ shape: 'plane', sizeM: made.sizeM }))) {
      const at = transform(pose, corner);
      expect(at.z).toBeCloseTo(1, 9);
      expect(Math.min(Math.abs(at.x), Math.abs(at.x - 2))).toBeCloseTo(0, 9);
      expect(Math.min(Math.abs(at.y + 1), Math.abs(at.y + 2))).toBeCloseTo(0, 9);
    }
    expect(planeOf({ x: 0, y: 0, z: 0 }, { x: 1, y: 0, z: 0 }, { x: 2, y: 0, z: 0 }, ZERO)).toMatch(
      /of a line/,
    );
  });

  it('a box has the corners that were clicked, however it is turned', () => {
    const rotation = facing({ x: 1, y: 0, z: 1 });
    const [a, b] = [
      { x: 1, y: 0, z: 1 },
      { x: 2, y: -0.8, z: 1.4 },
    ];
    const made = boxOf(a, b, rotation);
    if (typeof made === 'string') throw new Error(made);
    expect(made.sizeM.y).toBeCloseTo(0.8, 9);
    const corners = cornersOf(thing({ shape: 'box', sizeM: made.sizeM })).map((corner) =>
      transform(made.pose, corner),
    );
    for (const clicked of [a, b]) {
      expect(Math.min(...corners.map((corner) => distance(corner, clicked)))).toBeCloseTo(0, 9);
    }
    expect(boxOf(a, { ...b, y: 0 }, rotation)).toMatch(/0 mm high/);
  });
});

describe('what things are fixed to', () => {
  const drawer = thing({
    marker: { family: 'apriltag36h11', id: 3, sideM: 0.08 },
    parentFromObject: { ...IDENTITY, translation: { x: 0, y: 0, z: -0.2 } },
  });
  const marker = (id: number) => ({
    ...{ family: 'apriltag36h11', id },
    worldFromMarker: {
      rotation: { x: 1, y: 0, z: 0, w: 0 }, // half a turn about x
      translation: { x: 1, y: 2, z: 3 },
    },
  });

  it('a marker carries them; one that was not seen leaves them nowhere', () => {
    const at = worldFromThing(drawer, () => undefined, [marker(2), marker(3)]);
    expect(at?.translation).toEqual({ x: 1, y: 2, z: 3.2 });
    expect(worldFromThing(drawer, () => undefined, [marker(2)])).toBeUndefined();
  });

  it('an annotation does so too, without its turn; the rest stands in the world', () => {
    const fixed = thing({ annotationId: 'a' });
    expect(worldFromThing(fixed, () => ({ x: 1, y: 0, z: 0 }), [])?.translation.x).toBe(1);
    expect(worldFromThing(fixed, () => undefined, [])).toBeUndefined();
    expect(worldFromThing(thing({}), () => undefined, [])).toEqual(IDENTITY);
  });

  it('no ray stops at what moves', () => {
    const ray = { originInWorld: { x: 0, y: -1, z: 0 }, directionInWorld: { x: 0, y: 1, z: 0 } };
    expect(hitSurface([thing({})], ray)?.pointInWorld.y).toBeCloseTo(0, 12);
    expect(hitSurface([drawer], ray)).toBeUndefined();
  });
});

describe('contact shadows', () => {
  const quad = (x0: number, x1: number, z0: number, z1: number, y: number) =>
    [
      ...[[x0, z0] as const, [x1, z0] as const, [x1, z1] as const],
      ...[[x0, z0] as const, [x1, z1] as const, [x0, z1] as const],
    ].map(([x, z]) => ({ x, y, z }));
  const foot = { material: 'virtual', corners: quad(-0.3, 0.3, -0.2, 0.2, -0.0002) } as const;

  it('are dark under a foot, gone beside it, and fall only on what is there', () => {
    const floor = { material: 'real', corners: quad(-2, 0.31, -2, 2, 0) } as const;
    const { positions, darkness, triangles } = contactShadows([foot, floor]);
    expect(triangles.length).toBeGreaterThan(100);
    expect(Math.max(...darkness)).toBe(0.5);
    positions.forEach(({ x, y, z }, i) => {
      expect(y).toBeCloseTo(-0.0022, 9);
      const away = Math.hypot(Math.max(0, Math.abs(x) - 0.3), Math.max(0, Math.abs(z) - 0.2));
      expect(away).toBeLessThan(0.0801);
      if (x > 0.311 || away > 0.0799) expect(darkness[i]).toBe(0); // beside the floor; the rim's end
      if (away < 1e-9 && x <= 0.3) expect(darkness[i]).toBe(0.5);
    });
  });

  it('need something that holds', () => {
    expect(Math.max(...contactShadows([foot]).darkness)).toBe(0);
    const guide = { material: 'guide', corners: quad(-2, 2, -2, 2, 0) } as const;
    expect(Math.max(...contactShadows([foot, guide]).darkness)).toBe(0);
    expect(contactShadows([guide]).triangles).toEqual([]);
  });
});
