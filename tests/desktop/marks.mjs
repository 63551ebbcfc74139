// Marks that are turned, taken together, pinned up as pages, written in other scripts; the voices.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export async function runMarks(context, finding) {
  await turn(context, finding);
  await rectangle(context);
  await page(context, finding);
  await scripts(context);
  await voices(context);
}

/** An arrow, by its keys and by its handle. */
async function turn(context, { findObject, place }) {
  const { desktop, screen, check, annotations } = context;
  const arrow = await place(context, 'a', 'Arrow', async () =>
    screen.click(await findObject(context, 0)),
  );
  const id = arrow?.id;
  screen.press('v');
  await desktop.until('it is selected', ({ selected }) => selected === id);
  const turned = async (was) => {
    for (let i = 0; i < 40; ++i) {
      const now = annotations().find((mark) => mark.id === id)?.world_from_mark_xyzw;
      if (now && JSON.stringify(now) !== JSON.stringify(was)) return now;
      await sleep(250);
    }
    return undefined;
  };
  screen.press('period', 'period', 'period');
  const byKeys = await turned(undefined);
  const angle = byKeys && (2 * Math.acos(Math.min(1, Math.abs(byKeys[3]))) * 180) / Math.PI;
  check(
    'three presses of "." turn an arrow by 45 degrees',
    Math.abs(angle - 45) < 0.5,
    `${angle?.toFixed(2)} degrees`,
  );
  await still(context, true); // what is gripped stands where it was seen
  const { handle } = await desktop.until('the handle', (shown) => Boolean(shown.handle));
  screen.move(handle);
  screen.input('mousedown', 1);
  for (let i = 1; i <= 6; ++i) screen.move([handle[0] + 5 * i, handle[1] + 5 * i]);
  screen.input('mouseup', 1);
  const byHand = await turned(byKeys);
  await still(context, false);
  check('and its handle turns it too', Boolean(byHand), JSON.stringify(byHand));
}

/** Holds the picture, or lets it go on. */
async function still({ desktop, screen }, wanted) {
  if (Boolean(desktop.look().video?.frozen) === wanted) return;
  screen.press('p');
  await desktop.until('held, or not', ({ video }) => Boolean(video?.frozen) === wanted);
}

/** Every mark in the picture, by a rectangle round it. */
async function rectangle(context) {
  const { desktop, screen, check, shot } = context;
  screen.press('Escape', '2');
  await desktop.until('the rectangle is in hand', ({ tool }) => tool === 'Select several');
  const { left, top, width, height, scale } = desktop.look().video;
  screen.move([left + 4, top + 4]);
  screen.input('mousedown', 1);
  for (const share of [0.3, 0.6, 0.97]) {
    screen.move([left + share * width * scale, top + share * height * scale * 0.98]);
  }
  await desktop.until('the rectangle', ({ area }) => area);
  shot('rectangle');
  screen.input('mouseup', 1);
  const { selection } = await desktop.until('some', (shown) => shown.selection.length > 1);
  check('a rectangle selects the marks in it', true, `${selection.length} marks`);
  screen.press('v', 'Escape', 'ctrl+a');
  const all = await desktop.until('all', (s) => s.selection.length === s.marks.length);
  check('Ctrl A selects all', true, `${all.selection.length} of ${all.marks.length}`);
  screen.press('Escape', 'Escape');
}

const OBJECTS = [
  '<</Type/Catalog/Pages 2 0 R>>',
  '<</Type/Pages/Count 2/Kids[3 0 R 5 0 R]>>',
  '<</Type/Page/Parent 2 0 R/MediaBox[0 0 300 200]>>',
  '<</Length 44>>stream\n0.8 0.1 0.1 rg 20 20 260 160 re f 1 1 0 rg 60 60 99 80 re f\nendstream',
  '<</Type/Page/Parent 2 0 R/MediaBox[0 0 300 200]/Contents 4 0 R>>',
];

/** Pixels of the page's own red. */
function red({ data }) {
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] > 190 && data[i + 1] < 45 && data[i + 2] < 45) ++count;
  }
  return count;
}

/** The second page of a PDF. */
async function page(context, { findObject, marked, idsOf }) {
  const { desktop, screen, check, annotations } = context;
  const file = join(context.folder, 'manual.pdf');
  const body = OBJECTS.map((text, i) => `${i + 1} 0 obj${text}endobj\n`).join('');
  writeFileSync(file, `%PDF-1.4\n${body}trailer<</Root 1 0 R>>\n`);
  screen.press('u');
  await desktop.until('the picture is in hand', ({ tool }) => tool === 'Picture');
  await still(context, true); // the page stays in view
  const redBefore = red(screen.grab());
  const before = idsOf(desktop.look());
  screen.click(await findObject(context, 1));
  await desktop.until('the dialog', ({ editing }) => editing);
  await sleep(300);
  screen.input('type', '--delay', '30', file);
  await sleep(300);
  screen.press('Tab');
  await sleep(200);
  screen.input('type', '2');
  await sleep(300);
  context.shot('page-dialog');
  screen.press('Return');
  const shown = await desktop.until('the page', marked(before), 30_000);
  const { id } = shown.marks.find((mark) => !before.has(mark.id));
  await sleep(1500);
  context.shot('page');
  const kept = annotations().find((mark) => mark.id === id);
  const more = red(screen.grab()) - redBefore;
  check(
    'the second page of a PDF is pinned up, and seen',
    kept?.shape === 'picture' && more > 200,
    `${kept?.shape}, ${more} red pixels more`,
  );
  screen.press('v');
  await still(context, false);
  screen.press('Escape');
}

/** Text beyond Latin: the fonts are found while it runs. */
async function scripts(context) {
  const { desktop, screen, check } = context;
  const { frame } = desktop.look().video;
  const text = 'שמן · 油位 · زيت · 😀';
  const said =
    'Ölstand · масло · λάδι · 油位检查 · ☎ ✂ 😀 🔧 · בדוק את השמן לפני שאתה מתחיל לעבוד · افحص الزيت';
  context.ask('say', said);
  const where = ['--pixel', '320,200', '--frame', String(frame)];
  context.ask('annotate', ...where, '--shape', 'note', '--text', text);
  await desktop.until('the note', ({ marks }) => marks.some((mark) => mark.text === text));
  screen.press('9');
  await desktop.until('the message field', ({ writing }) => writing);
  await sleep(1500);
  context.shot('scripts');
  screen.press('Escape');
  await desktop.until('keys are tools again', ({ writing }) => !writing);
  check('a note in six scripts is shown, and the window goes on', true, text);
}

/** Joins the voices; without a sound card it says so, and goes on. */
async function voices({ desktop, screen, check, shot }) {
  screen.press('8');
  const on = await desktop.until(
    'voice',
    ({ voice, voice_problem: problem }) => voice.startsWith('You') || problem !== '',
    20_000,
  );
  shot('voice');
  check(
    'the voices are joined, or what is missing is said',
    on.voice.startsWith('You') || on.voice_problem.startsWith('No sound'),
    on.voice || on.voice_problem.slice(0, 120),
  );
  if (on.voice !== '') screen.press('8');
  await desktop.until('voice is left', ({ voice }) => voice === '');
}
