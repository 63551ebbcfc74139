import { create } from '@bufbuild/protobuf';
import { describe, expect, it } from 'vitest';
import { Camera } from '../../src/geometry/camera';
import { clipFromEye, pinholeAround } from '../../src/geometry/pinhole';
import {
  GetModelResponseSchema,
  ListSceneResponseSchema,
  SceneMaterial,
  SceneShape,
} from '../../src/gen/saccade/v1/scene_pb';
import { SceneBook, type SceneCalls } from '../../src/session/scene_book';

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
  const calls = (data: Uint8Array, log: string[]): SceneCalls => ({
    listScene: ({ knownRevision }) => {
      log.push(`list ${knownRevision}`);
      if (knownRevision === 3n) {
        return Promise.resolve(create(ListSceneResponseSchema, { revision: 3n }));
      }
      return Promise.resolve(
        create(ListSceneResponseSchema, {
          revision: 3n,
          objects: [
            {
              ...{ id: 'a', name: 'shelf', modelId: 'm', scale: 0 },
              ...{ shape: SceneShape.MODEL, material: SceneMaterial.VIRTUAL },
            },
          ],
          models: [{ id: 'm', name: 'shelf', bytes: 5 }],
        }),
      );
    },
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

  it('fetches each model once, in pieces, and nothing while nothing is new', async () => {
    const book = new SceneBook();
    const log: string[] = [];
    const server = calls(new Uint8Array([1, 2, 3, 4, 5]), log);
    await book.look(server, 's');
    await book.look(server, 's');
    expect(log).toEqual(['list 0', 'model 0', 'model 3', 'list 3']);
    expect([...book.models.get('m')!]).toEqual([1, 2, 3, 4, 5]);
    expect(book.things[0]).toMatchObject({ name: 'shelf', material: 'virtual', scale: 1 });
    expect(book.version).toBe(1);
  });

  it('keeps what it has when a model is torn', async () => {
    const book = new SceneBook();
    await book.look(calls(new Uint8Array([1, 2]), []), 's');
    expect(book.things).toEqual([]);
    expect(book.version).toBe(0);
  });
});
