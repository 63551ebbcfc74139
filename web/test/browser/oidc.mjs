// A firm's people sign in: in real Chromium, through a real provider's own pages, with RS256 and with ES256.
import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { Expert } from './expert.mjs';
import { startProvider } from './provider.mjs';
import { startServer } from './server.mjs';

const OUT_MS = 1000;

export async function runOidc(options) {
  let failures = 0;
  for (const algorithm of ['RS256', 'ES256']) failures += await signIn(options, algorithm);
  return failures;
}

async function signIn({ server: binary, chromium, seed, shots, folder }, algorithm) {
  let failures = 0;
  const check = (name, ok, figures) => {
    console.log(`${ok ? 'ok  ' : 'FAIL'}  ${algorithm}: ${name}: ${figures}`);
    if (!ok) ++failures;
  };
  const shoot = async (expert, name) => {
    if (shots) await expert.page.screenshot({ path: join(shots, `${algorithm}-${name}.png`) });
  };
  const provider = await startProvider({ algorithm });
  const data = join(folder, `data-${algorithm}`);
  const config = join(folder, `${algorithm}.toml`);
  writeFileSync(
    config,
    `[auth]\nrequired = true\n[oidc]\nissuer = "${provider.issuer}"\nclient_id = "saccade"\n` +
      'name = "Firm & Sons"\n[oidc.roles]\nengineers = "pilot"\nall = "viewer"\n',
  );
  const server = await startServer(binary, [
    ...[
      '--source',
      `sim:desk?seed=${seed}&motion=stand&width=320&height=240`,
      '--data-dir',
      data,
      '--config',
      config,
    ],
    ...['--grpc', '127.0.0.1:0', '--http', '127.0.0.1:0'],
  ]);
  const saccade = (...words) =>
    execFileSync(join(dirname(binary), 'saccade'), [...words, '--data-dir', data], {
      encoding: 'utf8',
    });
  const people = () => JSON.parse(saccade('invites', '--json')).filter(({ person }) => person);
  await provider.allow(`${server.http}/`);
  const open = [];
  const visit = async (path = '/') => {
    const expert = await Expert.open(chromium, `${server.http}${path}`);
    open.push(expert);
    return expert;
  };
  const refused = async ({ page }, words) => {
    const status = page.locator('header .status');
    await status.filter({ hasText: words }).waitFor({ timeout: 60_000 });
    return (await status.innerText()).replace(/\n/g, ' ');
  };
  try {
    const ada = await visit('/?name=Somebody');
    const button = ada.page.getByRole('button', { name: 'Sign in with Firm & Sons' });
    await button.waitFor({ timeout: 60_000 });
    check('who has no invite is offered to sign in', true, await refused(ada, /invite/));
    await shoot(ada, 'offer');
    await logIn(ada, button, 'ada', provider);
    await ada.waitForStatus(/^tracking/, 120_000);
    await shoot(ada, 'in');
    const address = ada.page.url();
    check('who signed in sees the camera', true, `tracking, at ${address}`);
    check('the code is gone from the address', !/code=|state=/.test(address), address);
    const [row] = people();
    check(
      '`saccade invites` has their name',
      row?.label === 'Ada Lovelace' && row.role === 'pilot' && row.state === 'signed in',
      JSON.stringify(row),
    );
    const audit = JSON.parse(saccade('audit', '--json'));
    const joined = audit.find(({ call }) => call === 'SessionService/Join');
    check(
      'and the audit, whatever they call themselves',
      joined?.display_name === 'Ada Lovelace' && joined.invite_id === row.id,
      JSON.stringify(joined),
    );
    await ada.page.reload();
    await ada.waitForStatus(/^tracking/, 120_000);
    check('a reload needs no second sign-in', true, 'tracking again');
    const codes = provider.asked.filter((line) => line === 'POST /token').length;
    check('one code was taken to the provider', codes === 1, `${codes}`);

    await ada.page.goto('about:blank'); // two cores: one page with a moving picture at a time
    const bob = await visit();
    const his = bob.page.getByRole('button', { name: 'Sign in with Firm & Sons' });
    await logIn(bob, his, 'bob', provider);
    const why = await refused(bob, /none of the roles/);
    check('who has no role here is told so', people().length === 1, why);
    await shoot(bob, 'no-role');

    // A link with somebody else's code, sent to a victim: signing people in as another.
    const victim = await visit(`/?code=stolen&state=${'s'.repeat(43)}`);
    const words = await refused(victim, /not begun in this tab/);
    check('a code that one did not go for is not taken', true, words);

    await victim.page.goto('about:blank');
    await bob.page.goto('about:blank');
    await ada.page.goto(server.http);
    await ada.waitForStatus(/^tracking/, 120_000);
    await provider.rotate();
    const out = watchForRefusal(ada);
    const beganMs = Date.now();
    const said = saccade('revoke', row.id).trim();
    const { atMs, text } = await out;
    const ms = atMs - beganMs;
    check('out within a second of `saccade revoke`', ms < OUT_MS, `${ms} ms; ${said}; ${text}`);
    await logIn(ada, button, 'ada', provider);
    const barred = await refused(ada, /you were revoked here/);
    check('and may not sign in again', true, barred);
    console.log(`      ${saccade('revoke', row.id, '--undo').trim()}`);
    await ada.page.waitForTimeout(5200); // keys are fetched anew no more often
    await logIn(ada, button, 'ada', provider);
    await ada.waitForStatus(/^tracking/, 120_000);
    check('until that is undone; with the new key of the provider', true, 'tracking');

    await ada.page.goto('about:blank');
    const wearer = await visit('/wearer');
    const theirs = wearer.page.getByRole('button', { name: 'Sign in with Firm & Sons' });
    await logIn(wearer, theirs, 'ada', provider);
    await wearer.page.waitForURL(/\/wearer(\?|$)/, { timeout: 60_000 });
    check('one comes back to the page that one came from', true, wearer.page.url());
    const errors = open.flatMap((expert) => expert.errors);
    check('page errors', errors.length === 0, errors.join('; ') || 'none');
  } finally {
    for (const expert of open) await expert.close();
    await server.stop();
    await provider.close();
  }
  return failures;
}

/** Through the provider's own pages: a name and a password, and that the page may know them. */
async function logIn({ page }, button, name, { issuer }) {
  await page.context().clearCookies(); // else the provider remembers who it was
  await button.press('Enter', { timeout: 60_000 });
  await page.waitForURL((url) => url.href.startsWith(issuer), { timeout: 60_000 });
  for (;;) {
    const login = page.locator('input[name=login]');
    const yes = page.getByRole('button', { name: /continue/i });
    await login.or(yes).first().waitFor({ timeout: 60_000 });
    if (await login.isVisible()) {
      await login.fill(name);
      await page.locator('input[name=password]').fill('whatever');
      await page.getByRole('button', { name: /sign-in/i }).click();
      continue;
    }
    await yes.click();
    break;
  }
  await page.waitForURL((url) => !url.href.startsWith(issuer), { timeout: 60_000 });
}

/** Watched from within, so that no slow tool counts. */
function watchForRefusal({ page }) {
  return page.evaluate(
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
}
