import { create } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it } from 'vitest';
import { ListMapsResponseSchema } from '../../src/gen/saccade/v1/map_pb';
import { Maps } from '../../src/session/maps';
import type { Clients } from '../../src/transport/clients';
import { mapName, mapWords, problemOfName } from '../../src/ui/maps_sheet';

const kept = { id: 'a', name: '', savedMs: 0, metric: true, landmarks: 812, bytes: 2_340_000 };

describe('the maps that are kept', () => {
  it('are told by name, size and date', () => {
    expect(mapName(kept)).toBe('kept by itself');
    expect(mapName({ ...kept, name: 'bench' })).toBe('bench');
    const words = mapWords({ ...kept, savedMs: Date.UTC(2026, 10, 30, 12) }, 'en-GB');
    expect(words).toMatch(/^30 Nov 2026.* · 2\.3 MB · 812 landmarks · in metres$/);
    expect(mapWords({ ...kept, landmarks: 1, metric: false })).toMatch(/ 1 landmark · scale unkn/);
  });

  it('have a name that the server takes', () => {
    expect(problemOfName('')).not.toBe('');
    expect(problemOfName('ü'.repeat(100))).toBe('');
    expect(problemOfName('ü'.repeat(101))).toBe('2 bytes too long: shorten it.');
  });

  it('come as the server has them, and what fails is said in words', async () => {
    const facts = { mapId: 'x', name: 'bench', savedUnixS: 7n, landmarkCount: 3, bytes: 9n };
    const map = {
      list: () => Promise.resolve(create(ListMapsResponseSchema, { maps: [facts] })),
      load: () => Promise.reject(new ConnectError('another lens', Code.FailedPrecondition)),
    };
    const maps = new Maps({ clients: { map } as unknown as Clients });
    expect(await maps.list()).toEqual([
      { id: 'x', name: 'bench', savedMs: 7000, metric: false, landmarks: 3, bytes: 9 },
    ]);
    await expect(maps.load('x')).rejects.toThrow('another lens');
  });
});
