// The marks as a whole: found, only mine, hidden, and kept with the picture.
import { readFileSync } from 'node:fs';
import { decodePng } from './pictures.mjs';

/** Pixels that a mark or its label covers on the video's canvas of marks. */
const drawn = (expert) =>
  expert.page.evaluate(() => {
    const canvas = document.querySelector('.video canvas.marks');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) count += data[i] > 0 ? 1 : 0;
    return count;
  });

const rows = (expert) =>
  expert.page.locator('aside li .title').evaluateAll((all) => all.map((each) => each.textContent));

/** The JSON in the chunk of a PNG. */
function textIn(png) {
  const at = png.indexOf('iTXt');
  const data = png.subarray(at + 4, at + 4 + png.readUInt32BE(at - 4)).toString('utf8');
  return JSON.parse(data.slice(data.indexOf('{')));
}

export async function checkMarks({ expert, check, annotations }) {
  const { page } = expert;
  const settle = () => page.waitForTimeout(600);
  await expert.press('Escape');
  let all = await rows(expert);
  // What was deleted before is gone, here and there.
  for (let i = 0; i < 50 && all.length !== (await annotations.list({})).annotations.length; ++i) {
    await page.waitForTimeout(200);
    all = await rows(expert);
  }
  await expert.press('/');
  await page.keyboard.type('KEEPING worth'); // letters are tools elsewhere
  await settle();
  const found = await rows(expert);
  const count = await page.locator('aside h2 .number').innerText();
  await expert.press('Escape');
  await settle();
  check(
    'marks are found by their words, whatever order and case',
    found.length === 1 &&
      found[0] === 'worth keeping' &&
      (await rows(expert)).length === all.length,
    `${count}: ${found.join(' | ')}; then ${all.length} again`,
  );

  await expert.press('f'); // any state: what follows compares drawings of the same picture
  await expert.press('f');
  await expert.press('p');
  await settle();
  const before = await drawn(expert);
  await expert.press('m');
  await settle();
  const hidden = await drawn(expert);
  const pressed = await page.locator('[data-control="hide"]').getAttribute('aria-pressed');
  await expert.press('m');
  await settle();
  const after = await drawn(expert);
  check(
    'hidden marks are drawn nowhere, and come back',
    pressed === 'true' && hidden < 0.9 * before && after - hidden > 0.8 * (before - hidden),
    `${before} pixels, ${hidden} hidden (dots and axes), ${after} after`,
  );

  const download = page.waitForEvent('download', { timeout: 10_000 });
  await expert.press('k');
  const png = readFileSync(await (await download).path());
  const picture = decodePng(png);
  const said = textIn(png);
  const frozen = Number(await page.locator('canvas.still').getAttribute('data-frame-id'));
  const server = (await annotations.list({})).annotations;
  check(
    'a snapshot is the picture with its marks, and says which frame, pose and marks',
    picture.width === 640 &&
      said.frameId === frozen &&
      said.marks.length === server.length &&
      said.worldFromCamera !== undefined,
    `${picture.width} x ${picture.height}, frame ${said.frameId}, ${said.marks.length} marks, by ${said.takenBy}`,
  );
  await expert.press('p');
}
