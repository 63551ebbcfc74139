// Somebody far away opens an invite link: over https, with the server's own authority trusted as a person
// would trust it; is refused in words without one; and is out within a second once it is revoked.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdirSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { checkConstraints } from './constraints.mjs';
import { Expert } from './expert.mjs';
import { startServer } from './server.mjs';

const OUTSIDE = '10.77.0.1'; // in a network namespace of its own
const OUT_MS = 1000;

/** A network of its own with an address beyond loopback; undefined: this user may not make one. */
function makeNetwork() {
  const name = `saccade-${process.pid}`;
  const ip = (...words) => spawnSync('ip', words).status === 0;
  if (!ip('netns', 'add', name)) return undefined;
  ip('-n', name, 'link', 'set', 'lo', 'up');
  ip('-n', name, 'addr', 'add', `${OUTSIDE}/32`, 'dev', 'lo');
  return {
    prefix: ['ip', 'netns', 'exec', name],
    host: OUTSIDE,
    add: (address) => ip('-n', name, 'addr', 'add', `${address}/32`, 'dev', 'lo'),
    close: () => ip('netns', 'del', name),
  };
}

export async function runInvite({ server: binary, chromium, seed, shots, folder }) {
  const network = makeNetwork();
  const prefix = network?.prefix ?? [];
  const host = network?.host ?? '127.0.0.1';
  const data = join(folder, 'data');
  const context = { failures: 0, shots, chromium, folder, prefix, host, network, data };
  context.check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${name}: ${figures}`);
    if (!ok) ++context.failures;
  };
  const cli = join(dirname(binary), 'saccade');
  context.saccade = (...words) => {
    const [command, ...rest] = [...prefix, cli, ...words, '--data-dir', data];
    return execFileSync(command, rest, { encoding: 'utf8' });
  };
  const common = ['--source', `sim:desk?seed=${seed}&motion=stand`, '--data-dir', data];
  const listen = ['--grpc', `${host}:0`, '--http', `${host}:0`];
  try {
    const config = join(folder, 'server.toml');
    writeFileSync(config, '[tls]\nrequired = true\n[auth]\nrequired = true\n');
    // Beyond loopback nothing has to be asked for.
    const asked = network ? [] : ['--config', config];
    console.log(`      served at ${host}${network ? ', in a network of its own' : ''}`);
    context.server = await startServer(binary, [...common, ...listen, ...asked], prefix);
    context.url = `https://${context.server.address}`;
    await checkLinks(context);
    if (network) await checkConstraints(context, join(folder, 'home'));
    await context.server.stop();
    if (network) {
      context.server = await startServer(binary, [...common, ...listen, '--insecure'], prefix);
      await checkBanner(context);
    }
  } finally {
    await context.expert?.close();
    await context.server?.stop();
    network?.close();
  }
  return context.failures;
}

async function checkLinks(context) {
  const { check, chromium, prefix, url, folder, saccade } = context;
  const home = join(folder, 'home');
  const open = (address, trusting) => Expert.open(chromium, address, { home: trusting, prefix });

  const stranger = await open(url, join(folder, 'nobody')).catch((error) => error);
  check(
    'a browser that does not trust the root opens nothing',
    stranger instanceof Error && /ERR_CERT_AUTHORITY_INVALID/.test(stranger.message),
    stranger instanceof Error ? stranger.message.split('\n')[0] : 'it did',
  );
  if (!(stranger instanceof Error)) await stranger.close();
  trust(context, home);

  context.expert = await open(url, home);
  await refusedWith(context, 'without an invite', /you need an invite/);
  const { page } = context.expert;
  await page.goto(`${url}/#invite=i000000000000.${'A'.repeat(43)}`); // it loads itself anew
  await refusedWith(context, 'with a bad token', /does not know this invite/);

  const { link, id } = JSON.parse(saccade('invite', '--role', 'pilot', '--json'));
  check('the link begins as the page does', link.startsWith(`${url}/#invite=`), link.split('#')[0]);
  await page.goto(link); // the same page but for the fragment
  await context.expert.waitForStatus(/^tracking/, 60_000);
  await page.locator('.app[data-first-picture-ms]').waitFor();
  check('the invite is gone from the address', !page.url().includes('invite'), page.url());
  await page.reload();
  await context.expert.waitForStatus(/^tracking/, 60_000);
  check('a reload needs no second invite', true, 'tracking again');
  const again = await context.expert.context.newPage();
  await again.goto(link);
  const inAgain = again.locator('header .status strong', { hasText: /^tracking/ });
  await inAgain.waitFor({ timeout: 60_000 });
  check('the used link opens again in the browser that used it', true, 'tracking');
  await again.close();

  const other = await open(link, home);
  await refusedWith({ ...context, expert: other }, 'the used link elsewhere', /used up/);
  await other.close();

  await revocation(context, id);
  await page.goto(link);
  await refusedWith(context, 'the revoked link', /was revoked/);
  const { errors } = context.expert;
  check('page errors', errors.length === 0, errors.join('; ') || 'none');
}

/** As a person does in the browser's settings. */
export function trust({ saccade, folder }, home) {
  const store = join(home, '.pki/nssdb');
  mkdirSync(store, { recursive: true });
  const root = join(folder, 'root.pem');
  saccade('trust', '--out', root);
  const certutil = (...words) => execFileSync('certutil', ['-d', `sql:${store}`, ...words]);
  certutil('-N', '--empty-password');
  certutil('-A', '-t', 'C,,', '-n', 'saccade', '-i', root);
}

async function refusedWith({ check, expert, shots }, name, words) {
  const status = expert.page.locator('header .status');
  await status.filter({ hasText: words }).waitFor({ timeout: 20_000 });
  const text = (await status.innerText()).replace(/\n/g, ' ');
  check(`refused ${name}, in words`, /refused/.test(text) && words.test(text), text);
  if (shots) await expert.page.screenshot({ path: join(shots, `${name}.png`) });
}

async function revocation(context, id) {
  const { check, expert, saccade } = context;
  // Watched from within, so that no slow tool counts.
  const out = expert.page.evaluate(
    () =>
      new Promise((resolve) => {
        const look = () => {
          const text = document.querySelector('header .status')?.textContent ?? '';
          if (/refused/.test(text)) resolve({ atMs: Date.now(), text });
          else setTimeout(look, 5);
        };
        look();
      }),
  );
  const beganMs = Date.now(); // the program's own start counts as well
  const said = saccade('revoke', id).trim();
  const { atMs, text } = await out;
  const ms = atMs - beganMs;
  const ok = ms < OUT_MS && /was revoked/.test(text);
  check('out within a second of `saccade revoke`', ok, `${ms} ms; ${said}; page: ${text}`);
}

async function checkBanner(context) {
  const { check, chromium, prefix, server } = context;
  for (const path of ['/', '/wearer']) {
    const expert = await Expert.open(chromium, `${server.http}${path}`, { prefix });
    const banner = expert.page.locator('.insecure');
    await banner.waitFor({ timeout: 20_000 });
    check(`--insecure is said on ${path}`, true, await banner.innerText());
    await expert.close();
  }
  check('and on the console', /INSECURE/.test(server.errors()), 'yes');
}
