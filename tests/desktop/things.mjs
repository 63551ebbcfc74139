// Things of the scene in the window: a shelf that is let go on the floor, pushed to the wall, turned, taken away.
import { inCamera, project } from '../../web/test/browser/optics.mjs';
import { explained, fixed, measured, registered } from './things_clicks.mjs';

// The simulator's room about its chessboard: WorldFromRoom in server/sim/wearer.cpp.
const ROOM = { size: '4,2.5,4', at: '0.16,1.22,-1.992' };
export const FLOOR_Y = 1.22;
export const WALL_Z = 0.008;
const HALF_SHELF_M = 0.15; // of its depth
const CONTACT_M = 1e-3;

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const middle = ([x, y, width, height]) => [x + width / 2, y + height / 2];

export async function runThings(context) {
  context.server = await context.start();
  context.desktop = await context.startDesktop(['--name', 'Tess']);
  const { desktop, screen, ask } = context;
  await desktop.until('tracking', ({ status }) => status.startsWith('tracking'), 90_000);
  ask('scene', 'add', '--shape', 'room', '--size', ROOM.size, '--at', ROOM.at, '--name', 'room');
  screen.press('4');
  await desktop.until('the room is listed', ({ things }) => things?.count === 1);
  await measured(context);
  await registered(context);
  await place(context);
  await explained(context);
  await fixed(context);
  await pushed(context);
  await turned(context);
  await removed(context);
}

const shelf = ({ ask }) => ask('scene', 'list').objects.find(({ name }) => name === 'shelf');
export const mm = (m) => `${(1000 * m).toFixed(2)} mm`;
const turnDeg = ({ rotation_xyzw: [, y, , w] }) => (2 * Math.atan2(y, w) * 180) / Math.PI;

/** Presses a button of the panel, as its words are, once it stands still. */
export async function pressButton(context, words) {
  const { desktop, screen } = context;
  let before;
  const shown = await desktop.until(
    words,
    ({ seq, things }) => {
      const rect = things?.buttons[words];
      const still = before && rect && before.seq !== seq && String(before.rect) === String(rect);
      if (before?.seq !== seq) before = { seq, rect };
      return still;
    },
    10_000,
  );
  context.tells = shown.things.tells;
  screen.click(middle(shown.things.buttons[words]));
  // Pressed in one picture and let go in the next: until then the pointer stays.
  await desktop.until('drawn', ({ seq }) => seq >= shown.seq + 4, 15_000);
}

/** Where a point of the world is in the window, in the map. */
export function inMap({ desktop }, point) {
  const { map } = desktop.look();
  const [x, y, z, ...turn] = map.eye;
  const pose = { translation_m: [x, y, z], rotation_xyzw: turn };
  const [left, top, width, height] = map.pane;
  const centre = { cxPx: width / 2, cyPx: height / 2 };
  const eye = { fxPx: map.focal, fyPx: map.focal, distortion: [], ...centre };
  const at = project(eye, inCamera(pose, point));
  return at && [left + at[0], top + at[1]];
}

/** What the panel says once it has heard from the server. */
export async function says({ desktop, tells }, pattern) {
  const { things } = await desktop.until(
    String(pattern),
    (shown) => !shown.things.busy && shown.things.tells > tells && pattern.test(shown.things.said),
    15_000,
  );
  return things.said;
}

async function place(context) {
  const { desktop, screen, check, shot } = context;
  screen.press('h');
  const [paneLeft, paneTop, paneWidth] = desktop.look().map.pane;
  screen.move([paneLeft + paneWidth / 2, paneTop + 100]);
  screen.input('click', '--repeat', '8', '--delay', '30', '5'); // away from the map, to see its floor
  await sleep(1500);
  await pressButton(context, 'A click');
  shot('things-choice');
  await pressButton(context, 'places a shelf');
  screen.click(inMap(context, [0.7, FLOOR_Y, -1.3]));
  const said = await says(context, /rests on|Not/);
  const base = shelf(context)?.position_m[1] ?? NaN;
  check(
    'a shelf that is let go stands on the floor',
    Math.abs(base - FLOOR_Y) < CONTACT_M,
    `"${said}", ${mm(base - FLOOR_Y)}`,
  );
  shot('things-placed');
}

async function pushed(context) {
  await pressButton(context, 'Away');
  const said = await says(context, /touches|Not/);
  const near = shelf(context).position_m[2] + HALF_SHELF_M - WALL_Z;
  context.check(
    'pushed away it stops at the wall',
    /touches room/.test(said) && Math.abs(near) < 0.4, // turned as it was let go, a corner touches first
    `"${said}", its back ${mm(near)} beyond the wall, were it parallel`,
  );
  context.shot('things-at-the-wall');
}

async function turned(context) {
  const before = turnDeg(shelf(context));
  await pressButton(context, 'Turn >');
  const said = await says(context, /rests on|Not/);
  const by = Math.abs(turnDeg(shelf(context)) - before);
  const refused = /Not done/.test(said); // at the wall there may be no room to turn
  context.check(
    'turned by 15 degrees, or refused where the wall is',
    refused ? by < 1e-6 : Math.abs(by - 15) < 1e-3,
    `"${said}", ${by.toFixed(2)} deg`,
  );
}

async function removed(context) {
  const { desktop } = context;
  context.count = desktop.look().things.count;
  await pressButton(context, 'Delete');
  await desktop.until(
    'the shelf is gone',
    ({ things }) => things.count === context.count - 1,
    10_000,
  );
  await pressButton(context, 'Undo');
  await desktop.until('the shelf is back', ({ things }) => things.count === context.count, 10_000);
  const said = await says(context, /is back/);
  context.check('deleted, and back by undo', shelf(context) !== undefined, `"${said}"`);
}
