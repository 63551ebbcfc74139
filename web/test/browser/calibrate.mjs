// The camera's calibration in a real browser: EuRoC's own pictures of an AprilGrid, shown live. Asks for the
// target, looks on until there is a lens, finishes, reads the result, downloads every form, keeps it.
// Needs ../shared/data/calib_euroc; prints "skipped" without it.
import { copyFileSync, existsSync, mkdirSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium as browsers } from 'playwright-core';
import { barriers } from './axe.mjs';
import { startServer } from './server.mjs';

const TRUTH_FX = 458.654; // EuRoC's own
const SIZES = {
  desk: { width: 1440, height: 900 },
  phone: { width: 360, height: 740 },
};

export async function runCalibrate({ server: binary, chromium, shots, folder }) {
  const data = fileURLToPath(new URL('../../../../shared/data/calib_euroc', import.meta.url));
  if (!existsSync(data)) {
    console.log(`skipped: no ${data}`);
    return 0;
  }
  if (shots) mkdirSync(shots, { recursive: true });
  const set = join(folder, 'board');
  mkdirSync(set);
  for (const name of readdirSync(data)) {
    if (name.endsWith('.jpg')) copyFileSync(join(data, name), join(set, name));
  }
  const server = await startServer(binary, [
    ...['--source', `dataset:${set}?fps=3`, '--data-dir', join(folder, 'data')],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const browser = await browsers.launch({
    executablePath: chromium,
    args: ['--no-sandbox', '--disable-gpu'],
  });
  const context = { failures: 0, shots };
  context.check = (name, good, told) => {
    console.log(`${good ? 'ok  ' : 'FAIL'}  ${name}: ${told}`);
    if (!good) ++context.failures;
  };
  try {
    context.page = await browser.newPage({ viewport: SIZES.desk, acceptDownloads: true });
    const errors = [];
    context.page.on('pageerror', (error) => errors.push(String(error)));
    await context.page.goto(`${server.http}/calibrate`);
    await form(context);
    await showing(context);
    await result(context);
    context.check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    await browser.close();
    await server.stop();
  }
  return context.failures;
}

async function picture({ page, shots }, name) {
  if (shots) await page.screenshot({ path: join(shots, `calibrate-${name}.png`), fullPage: true });
}

async function noBarriers(context, where) {
  const found = await barriers(context.page);
  context.check(`axe, ${where}`, found.length === 0, found.join('; ') || 'no barrier');
}

/** By keys alone: what is wrong is said where it was asked for, then it starts. */
async function form(context) {
  const { page } = context;
  await page.getByText('not started').waitFor();
  await noBarriers(context, 'form');
  await picture(context, 'form');
  await page.getByRole('combobox', { name: 'Target' }).selectOption('aprilgrid');
  const gap = page.getByLabel('Gap, as a share of the side');
  await gap.fill('wide');
  await gap.press('Enter');
  const refused = page.getByRole('alert');
  await refused.filter({ hasText: 'as in 6x6:0.088:0.3' }).waitFor();
  context.check('a target that is none', true, await refused.textContent());
  await gap.fill('0.3');
  await page.getByRole('combobox', { name: 'Lens' }).selectOption('brown_conrady');
  await gap.press('Enter');
}

async function showing(context) {
  const { page } = context;
  await page.getByText('looking for the aprilgrid of 6 x 6').waitFor({ timeout: 20_000 });
  await page
    .getByText(/^RMS \d/)
    .first()
    .waitFor({ timeout: 120_000 });
  const advice = await page.locator('.advice').textContent();
  context.check('advice', /board|tilt|turn|Enough|tags|Put/.test(advice), advice);
  const covered = await page.locator('.look canvas').getAttribute('aria-label');
  context.check('coverage', /in [1-9]\d* of 24 parts/.test(covered), covered);
  await noBarriers(context, 'showing');
  await picture(context, 'showing');
  await page.setViewportSize(SIZES.phone);
  await picture(context, 'showing-phone');
  await page.setViewportSize(SIZES.desk);
  const finish = page.getByRole('button', { name: 'Finish with these views' });
  const done = page.locator('.state', { hasText: /^done$/ });
  // All of it was shown by then.
  await page
    .getByText(/(2[4-9]|[3-9]\d) of 24 views/)
    .or(done)
    .first()
    .waitFor({ timeout: 60_000 })
    .catch(() => undefined);
  if (await finish.isVisible()) await finish.click({ timeout: 3000 }).catch(() => undefined);
  await done.waitFor({ timeout: 180_000 });
}

async function result(context) {
  const { page, check } = context;
  const cells = await page.locator('.result tbody tr').first().locator('th, td').allTextContents();
  const [name, value, sigma] = cells;
  const off = Math.abs(Number(value) - TRUTH_FX);
  check('fx', name === 'fx' && off < 0.005 * TRUTH_FX, `${value} ${sigma}; EuRoC: ${TRUTH_FX}`);
  check('sigma', Number(sigma.slice(2)) > 0 && Number(sigma.slice(2)) < 5, sigma);
  const rms = await page.locator('.result p.number').textContent();
  check('RMS', Number(/RMS ([\d.]+)/.exec(rms)?.[1]) < 0.25, rms);
  for (const [form, has] of [
    ['camera.yaml', 'model: brown_conrady'],
    ['Kalibr', 'distortion_model: radtan'],
    ['ROS', 'distortion_model: plumb_bob'],
    ['OpenCV', '%YAML:1.0'],
  ]) {
    const [file] = await Promise.all([
      page.waitForEvent('download'),
      page.getByRole('button', { name: form, exact: true }).click(),
    ]);
    const text = readFileSync(await file.path(), 'utf8');
    check(
      `download ${form}`,
      text.includes(has),
      `${file.suggestedFilename()}, ${text.length} bytes`,
    );
  }
  await page.emulateMedia({ colorScheme: 'dark' });
  await noBarriers(context, 'result, dark');
  await picture(context, 'result-dark');
  await page.emulateMedia({ colorScheme: 'light' });
  await noBarriers(context, 'result, light');
  await picture(context, 'result');
  await page.setViewportSize(SIZES.phone);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  check('phone, nothing is cut off', wide <= 0, `${wide} px too wide`);
  await picture(context, 'result-phone');
  const keep = page.getByRole('button', { name: 'Keep it for this camera' });
  if (await keep.isDisabled()) {
    const told = await page.locator('.result').innerText();
    const why = /too little to believe[^\n]*/.exec(told)?.[0] ?? told;
    check('what is not to be believed is not kept', /Not kept/.test(told), why);
    return;
  }
  await keep.click();
  const kept = page.getByText(/^Kept as .*cameras/);
  await kept.waitFor({ timeout: 10_000 });
  const path = /Kept as (\S+) and/.exec(await kept.textContent())?.[1] ?? '';
  check('kept', readFileSync(path, 'utf8').includes('one sigma: fx'), path);
}
