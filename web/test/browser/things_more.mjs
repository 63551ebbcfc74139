// Sliding along a wall, what explains a room, a room by numbers.
import { length, minus } from './optics.mjs';
import {
  CONTACT_M,
  cornersOf,
  does,
  FLOOR_Y,
  inMap,
  LEFT_X,
  mm,
  objects,
  panel,
  said,
  says,
  shelfOf,
  shot,
  WALL_Z,
  when,
  xyz,
} from './things.mjs';

/** Drawn aslant into the wall it stands at, a thing goes along it as far as the hand. */
export async function slid(context) {
  const { ann, check, shelf } = context;
  await does(context, 'select');
  const [x, y, z] = xyz(shelf);
  const [from, to] = [await inMap(context, [x, y, z]), await inMap(context, [x - 0.3, y, z - 0.5])];
  const held = [from[0], from[1] - 12];
  await ann.page.mouse.move(...held);
  await ann.page.mouse.down();
  await ann.page.mouse.move(held[0] + to[0] - from[0], held[1] + to[1] - from[1], { steps: 4 });
  await ann.page.mouse.up();
  const moved = await when(async () => {
    const now = await shelfOf(context);
    return length(minus(xyz(now), xyz(shelf))) > 0.1 && now;
  });
  const words = await says(context, /slides|Not/);
  const side = moved && Math.min(...cornersOf(moved).map(([a]) => a)) - LEFT_X;
  const way = moved ? xyz(moved)[2] - z : 0;
  check(
    'drawn aslant into the wall it slides along it as far as the hand goes',
    side >= 0 && side < CONTACT_M && Math.abs(way + 0.5) < 0.1 && /slides/.test(words),
    `"${words}", ${mm(side)} from the wall, ${way.toFixed(3)} m along it`,
  );
  await shot(context, 'slid');
  context.shelf = moved || shelf;
}

/** Clicks points, then Done where there is more than one. */
async function lay(context, kind, points) {
  await does(context, kind);
  for (const point of points) {
    await context.ann.click(await inMap(context, point));
    await new Promise((resolve) => setTimeout(resolve, 250));
  }
  if (points.length > 1) await panel(context).getByRole('button', { name: 'Done' }).click();
  return says(context, /is there|Not/);
}

/** The overlays of Koller's figure 7. */
export async function explained(context) {
  const { ann, check } = context;
  const wall = (x, y) => [x, y, WALL_Z];
  const floor = (x, z) => [x, FLOOR_Y, z];
  const words = [
    await lay(context, 'grid', [floor(0.9, -1.2)]),
    await lay(context, 'route', [floor(1.4, -0.4), floor(0.8, -1.0), floor(0.6, -1.8)]),
    await lay(context, 'pipe', [wall(0.9, 1.0), wall(0.9, 0.1), wall(1.5, 0.1)]),
    await lay(context, 'wire', [wall(1.2, 0.9), wall(1.7, 0.5)]),
    await lay(context, 'pointer', [wall(0.7, 0.5)]),
    await lay(context, 'inside inside', [wall(1.4, 0.4)]),
  ];
  const list = await objects(context);
  const kinds = ['grid', 'route', 'pipe', 'wire', 'pointer', 'inside'];
  const found = kinds.map((name) => list.find((one) => one.name === name));
  const materials = found.map((one) => one?.material).join();
  const [, route, pipe] = found;
  const deep = pipe ? pipe.parentFromObject.translationM.z - WALL_Z : NaN;
  const low = route ? route.parentFromObject.translationM.y - FLOOR_Y : NaN;
  check(
    'grid, route, pipe, wire, arrow and the inside of a cabinet are laid by clicks',
    materials === '3,3,4,4,3,4' && Math.abs(deep - 0.05) < 0.03 && Math.abs(low) < 0.03,
    `materials ${materials}; pipe ${mm(deep)} in the wall, route ${mm(low)} off the floor; "${words.join('"; "')}"`,
  );
  await shot(context, 'explained');
  await ann.enlarge('video');
  await new Promise((resolve) => setTimeout(resolve, 1500));
  await shot(context, 'explained-video');
  await ann.enlarge('map');
  await ann.page.locator('.map3d').focus();
  await ann.press('z');
  const left = await when(async () => !(await objects(context)).some((o) => o.name === 'inside'));
  check('undo takes the last one away', left === true, `"${await said(context)}"`);
}

/** A second room, by its numbers; then it is changed and taken away. */
export async function numbered(context) {
  const { check } = context;
  await panel(context).locator('summary', { hasText: 'By numbers' }).click();
  const fill = async (values) => {
    const inputs = panel(context).locator('details').first().locator('input');
    for (const [i, value] of values.entries()) await inputs.nth(i).fill(String(value));
  };
  await fill([3.2, 2.4, 5, 0.1, FLOOR_Y, -2, 30]);
  await panel(context).getByRole('button', { name: 'Add room' }).click();
  const there = await says(context, /room 2 is there|Not/);
  const added = (await objects(context)).find(({ name }) => name === 'room 2');
  await shot(context, 'numbers');
  await fill([3.2, 2.4, 5, 0.4, FLOOR_Y, -2, 30]);
  await panel(context).getByRole('button', { name: 'Change' }).click();
  await says(context, /is changed|Not/);
  const changed = (await objects(context)).find(({ name }) => name === 'room 2');
  const q = added?.parentFromObject.rotation;
  check(
    'a room is added by its numbers, and changed',
    added &&
      length(minus(xyz(added), [0.1, FLOOR_Y, -2])) < 1e-9 &&
      added.sizeM.z === 5 &&
      Math.abs(2 * Math.atan2(q.y, q.w) - Math.PI / 6) < 1e-9 &&
      changed &&
      Math.abs(xyz(changed)[0] - 0.4) < 1e-9,
    `"${there}", then "${await said(context)}"`,
  );
  await panel(context).locator('summary', { hasText: 'By numbers' }).click();
  if (added) await context.scene.removeObject({ sessionId: context.sessionId, id: added.id });
}
