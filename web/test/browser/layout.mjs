// Every size of window from a small phone to a wide desk, light and dark, by finger and by mouse: nothing
// is cut off, nothing overlaps, the picture keeps its share, and axe-core finds no barrier (WCAG 2.2 AA).
import { join } from 'node:path';
import { barriers } from './axe.mjs';
import { Expert } from './expert.mjs';
import { startServer } from './server.mjs';

export const SIZES = [
  { name: 'phone', width: 360, height: 640, touch: true },
  { name: 'phone-on-its-side', width: 844, height: 390, touch: true },
  { name: 'zoomed-200', width: 640, height: 360, touch: false },
  { name: 'tablet', width: 768, height: 1024, touch: true },
  { name: 'laptop', width: 1280, height: 720, touch: false },
  { name: 'desk', width: 1920, height: 1080, touch: false },
  { name: 'wide', width: 3440, height: 1440, touch: false },
];
const FINGER_PX = 44;
const PANELS = { marks: 'aside', gaze: 'section.gaze', talk: 'section.talk' };

export async function runLayout({ server: binary, chromium, seed, shots, folder }) {
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}`, '--mount', 'sim'],
    ...['--data-dir', join(folder, 'layout-data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const context = { failures: 0, shots };
  context.check = (name, problems) => {
    console.log(
      `${problems.length === 0 ? 'ok  ' : 'FAIL'}  ${name}: ${problems.join('; ') || 'none'}`,
    );
    if (problems.length > 0) ++context.failures;
  };
  try {
    const expert = await Expert.open(chromium, `${server.http}/?name=Ann`, { look: '' });
    context.page = expert.page;
    context.expert = expert;
    context.cdp = await expert.page.context().newCDPSession(expert.page);
    await expert.waitForStatus(/^tracking/, 60_000);
    await expert.page.locator('canvas.map[data-eye]').waitFor();
    await placeMarks(context);
    for (const size of SIZES) await atSize(context, size);
    await light(context);
    await wearer(context, `${server.http}/wearer.html`);
    context.check('page errors', expert.errors);
    await expert.close();
  } finally {
    await server.stop();
  }
  return context.failures;
}

/** Two marks, so that the list, the edge arrows and the labels have something to show. */
async function placeMarks({ expert, page }) {
  await expert.enlarge('video');
  const box = await page.locator('.video').boundingBox();
  for (const share of [0.4, 0.6]) {
    await expert.press('c');
    await expert.click([box.x + share * box.width, box.y + 0.55 * box.height]);
    await page.waitForTimeout(1500);
  }
  await expert.press('v');
}

async function atSize(context, size) {
  const { page, cdp, shots } = context;
  const { name, width, height, touch } = size;
  await page.setViewportSize({ width, height });
  await cdp.send('Emulation.setTouchEmulationEnabled', { enabled: touch });
  await page.waitForTimeout(700);
  context.check(`${name} ${width} x ${height}, words and tools`, await faults(page, size));
  context.check(`${name}, axe`, await barriers(page));
  if (shots) await page.screenshot({ path: join(shots, `layout-${name}.png`) });
  for (const [sheet, where] of Object.entries(PANELS)) {
    const button = page.locator(`button[data-sheet="${sheet}"]`);
    const panel = page.locator(where);
    if (!(await button.isVisible())) {
      context.check(
        `${name}, ${sheet} beside the picture`,
        (await panel.isVisible()) ? [] : ['hidden'],
      );
      continue;
    }
    await button.click();
    await panel.waitFor({ timeout: 3000 }).catch(() => undefined); // a slow page draws once a second
    await page.waitForTimeout(300);
    const problems = (await panel.isVisible()) ? await faults(page, size, true) : ['does not open'];
    context.check(`${name}, ${sheet} as a sheet`, problems);
    if (sheet === 'marks') context.check(`${name}, axe with a sheet`, await barriers(page));
    if (shots) await page.screenshot({ path: join(shots, `layout-${name}-${sheet}.png`) });
    await button.click();
  }
}

async function light(context) {
  const { page, cdp, shots } = context;
  await cdp.send('Emulation.setTouchEmulationEnabled', { enabled: false });
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.emulateMedia({ colorScheme: 'light' });
  await page.waitForTimeout(500);
  context.check('light, axe', await barriers(page));
  if (shots) await page.screenshot({ path: join(shots, 'layout-light.png') });
  await page.locator('button.help').click();
  await page.locator('dialog[open]').waitFor();
  context.check('help in light, axe', await barriers(page));
  await page.emulateMedia({ colorScheme: 'dark' });
  context.check('help in dark, axe', await barriers(page));
  await page.keyboard.press('Escape');
}

async function wearer(context, url) {
  const { page, shots } = context;
  await page.goto(url);
  await page.waitForTimeout(1500);
  for (const [width, height] of [
    [360, 640],
    [1280, 720],
  ]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(500);
    context.check(`wearer ${width} x ${height}, axe`, await barriers(page));
    if (shots) await page.screenshot({ path: join(shots, `layout-wearer-${width}.png`) });
  }
}

/** What is cut off, covered, too small for a finger, or takes too much of the picture. */
function faults(page, { touch }, withSheet = false) {
  return page.evaluate(
    ([finger, fingers, sheet]) => {
      const problems = [];
      const shown = (element) => element.checkVisibility?.() ?? element.offsetParent !== null;
      const { scrollWidth, scrollHeight } = document.documentElement;
      if (scrollWidth > innerWidth || scrollHeight > innerHeight)
        problems.push(`the page is ${scrollWidth} x ${scrollHeight}`);
      const main = document.querySelector('main').getBoundingClientRect();
      const share = (main.width * main.height) / (innerWidth * innerHeight);
      if (share < 1 / 3)
        problems.push(`the picture has ${(100 * share).toFixed(0)} % of the window`);
      const pressed = [
        ...document.querySelectorAll('nav button, header button, header input, .sheets button'),
      ];
      if (sheet) pressed.push(...document.querySelectorAll('.side button, .side input'));
      for (const button of pressed.filter(shown)) {
        const name =
          button.dataset.control ?? button.getAttribute('aria-label') ?? button.className;
        button.scrollIntoView({ block: 'nearest', inline: 'nearest' });
        const box = button.getBoundingClientRect();
        const at = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
        const hidden = getComputedStyle(button).visibility === 'hidden';
        if (!hidden && at !== button && !button.contains(at)) problems.push(`${name} is covered`);
        if (fingers && Math.min(box.width, box.height) < finger - 0.5)
          problems.push(`${name} is ${box.width.toFixed(0)} x ${box.height.toFixed(0)}`);
      }
      const words = [
        ...document.querySelectorAll(
          'header h1, header .status > *, header span, header input, header button',
        ),
      ]
        .filter((element) => shown(element) && element.children.length === 0)
        .map((element) => [element, element.getBoundingClientRect()])
        .filter(([, box]) => box.width > 0 && box.height > 0);
      for (const [one, a] of words) {
        if (a.right > innerWidth + 1 || a.left < -1)
          problems.push(`${one.className || one.tagName} is cut off`);
        for (const [other, b] of words) {
          if (one === other || other.compareDocumentPosition(one) & 4) continue;
          const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
          const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
          if (wide > 1 && high > 1)
            problems.push(
              `${one.className || one.tagName} over ${other.className || other.tagName}`,
            );
        }
      }
      return problems;
    },
    [FINGER_PX, touch, withSheet],
  );
}
