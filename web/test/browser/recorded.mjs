// A recording begun and ended at the page: everybody is told, the file is on the server's disk.
import { existsSync, statSync } from 'node:fs';

export async function checkRecorded({ expert, check, sleep, shot }) {
  const { page } = expert;
  const button = page.locator('footer button.record');
  const before = await button.innerText();
  await button.click();
  await page.waitForFunction(() =>
    /REC \d+:\d\d/.test(document.querySelector('footer button.record').textContent),
  );
  await page.waitForFunction(() =>
    /recorded/.test(document.querySelector('header .presence')?.textContent ?? ''),
  );
  await sleep(3000);
  const words = await button.innerText();
  const title = await button.getAttribute('title');
  await shot('recording');
  await button.click();
  await page.waitForFunction(
    () => document.querySelector('footer button.record').textContent === 'Record',
  );
  const file = /: (.*\.mcap), /.exec(title)?.[1] ?? '';
  const bytes = existsSync(file) ? statSync(file).size : 0;
  check(
    'a recording is begun, said to all, and ended',
    before === 'Record' && bytes > 100_000,
    `${words}, ${(bytes / 1e6).toFixed(1)} MB`,
  );
}
