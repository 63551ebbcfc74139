// The maps that the server keeps, at the page: saved, looked for, deleted after a question; a viewer sees only.
const SHEET = 'dialog[aria-labelledby="maps-heading"]';

export async function checkMaps({ expert, check, sleep, shot }) {
  const { page } = expert;
  await page.locator('footer button.maps').click();
  const sheet = page.locator(SHEET);
  const news = sheet.locator('.news');
  const names = async () => sheet.locator('li[data-map] strong').allInnerTexts();
  await sheet.locator('button.main').click();
  const nameless = await sheet.locator('.problem').innerText();
  await sheet.locator('#map-name').fill('Werkbank 2');
  let saved = '';
  // As soon as enough is mapped.
  for (let tries = 0; tries < 40 && !/is kept/.test(saved); ++tries, await sleep(500)) {
    await sheet.locator('button.main').first().click();
    await sheet.locator('.news:not(:empty), .problem:not(:empty)').first().waitFor();
    saved = await news.innerText();
  }
  const row = sheet.locator('li[data-map]', { hasText: 'Werkbank 2' });
  await row.waitFor();
  const words = (await row.innerText()).replaceAll('\n', ' ');
  check(
    'a map is kept under a name, with date and size',
    nameless === 'Give it a name.' && /20\d\d.*MB.*landmark/.test(words),
    words,
  );
  await shot('maps');
  await row.getByRole('button', { name: 'Load Werkbank 2' }).click();
  const asked = await row.innerText();
  await row.getByRole('button', { name: 'Leave it' }).click();
  const quiet = (await news.innerText()) === saved;
  await row.getByRole('button', { name: 'Load Werkbank 2' }).click();
  await row.getByRole('button', { name: 'Look for it' }).click();
  await page.waitForFunction(
    (which) => /is looked for/.test(document.querySelector(`${which} .news`).textContent),
    SHEET,
  );
  check('it is looked for after a question alone', /set aside/.test(asked) && quiet, asked);
  await row.getByRole('button', { name: 'Delete Werkbank 2' }).click();
  await row.getByRole('button', { name: 'Delete it' }).click();
  await page.waitForFunction(
    (which) => /is deleted/.test(document.querySelector(`${which} .news`).textContent),
    SHEET,
  );
  const left = await names();
  check('and deleted', !left.includes('Werkbank 2') && left.length > 0, left.join(', '));
  await page.keyboard.press('Escape');
  await expert.waitForStatus(/^tracking/, 30_000);
}
