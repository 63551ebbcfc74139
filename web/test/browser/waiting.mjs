// The waiting room, as people see it: who comes by a link reads that they wait; the wearer sees who it is, and
// lets in or refuses, by mouse and by keyboard alone.
import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { Expert } from './expert.mjs';
import { startServer } from './server.mjs';

const SEEN_MS = 5000; // the wearer's page asks every two seconds

export async function runWaiting({ server: binary, chromium, seed, shots, folder }) {
  let failures = 0;
  const check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++failures;
  };
  const data = join(folder, 'data');
  const config = join(folder, 'server.toml');
  writeFileSync(config, '[auth]\nrequired = true\n');
  const server = await startServer(binary, [
    ...['--source', `sim:desk?seed=${seed}&motion=stand`, '--data-dir', data, '--config', config],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0', '--waiting-room'],
  ]);
  const link = (role) => {
    const words = ['invite', '--role', role, '--json', '--data-dir', data];
    const out = execFileSync(join(dirname(binary), 'saccade'), words, { encoding: 'utf8' });
    return JSON.parse(out).link;
  };
  const open = [];
  const visit = async (url) => {
    const expert = await Expert.open(chromium, url);
    open.push(expert);
    return expert;
  };
  const named = (url, name) => url.replace('/#', `/?name=${name}#`);
  const shoot = async (expert, name) => {
    if (shots) await expert.page.screenshot({ path: join(shots, `${name}.png`) });
  };
  try {
    const wearer = await visit(link('wearer'));
    const room = wearer.page.getByRole('region', { name: 'Waiting room' });
    const ada = await visit(named(link('pilot'), 'Ada'));
    await ada.waitForStatus(/^waiting to be let in/, 20_000);
    await shoot(ada, 'waiting');
    const cameMs = Date.now();
    await room.getByText('Ada', { exact: true }).waitFor({ timeout: 20_000 });
    const ms = Date.now() - cameMs;
    check('the wearer sees who waits', ms < SEEN_MS, `${ms} ms`);
    const said = (await room.innerText()).replace(/\n/g, ' | ');
    check('with what they may do', /pilot: places marks and turns the head/.test(said), said);
    await shoot(wearer, 'lets-in');
    await room.getByRole('button', { name: 'Let in Ada' }).click();
    await ada.waitForStatus(/^tracking/, 60_000);
    check('who is let in sees the camera', true, 'tracking');
    await shoot(ada, 'let-in');

    const eve = await visit(named(link('viewer'), 'Eve'));
    await eve.waitForStatus(/^waiting to be let in/, 20_000);
    const refuse = room.getByRole('button', { name: 'Refuse Eve' });
    await refuse.waitFor({ timeout: 20_000 });
    for (let tabs = 0; tabs < 40; ++tabs) {
      if (await refuse.evaluate((button) => button === document.activeElement)) break;
      await wearer.press('Tab');
    }
    await wearer.press('Enter');
    const status = eve.page.locator('header .status');
    await status.filter({ hasText: /you were not let in/ }).waitFor({ timeout: 20_000 });
    check('who is refused reads so', true, (await status.innerText()).replace(/\n/g, ' '));
    await shoot(eve, 'refused');
    await room.waitFor({ state: 'hidden', timeout: 20_000 });
    check('an empty room takes no place', true, 'hidden');
    for (const { errors } of open)
      check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    for (const expert of open) await expert.close();
    await server.stop();
  }
  return failures;
}
