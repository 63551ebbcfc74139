// The server's authority, in the hands of a thief: what a browser that trusts it believes.
import { execFileSync, spawn } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Expert } from './expert.mjs';

const PRIVATE = '10.77.0.9';
const PUBLIC = '203.0.113.9';

/** A certificate for `address`, by the key that only the server should have. */
function forge({ folder, data }, address) {
  const file = (end) => join(folder, `${address}.${end}`);
  const openssl = (...words) => execFileSync('openssl', words, { stdio: 'pipe' });
  const curve = ['-newkey', 'ec', '-pkeyopt', 'ec_paramgen_curve:P-256', '-nodes'];
  openssl('req', ...curve, '-keyout', file('key'), '-subj', '/CN=thief', '-out', file('csr'));
  writeFileSync(file('ext'), `subjectAltName=IP:${address}\nextendedKeyUsage=serverAuth\n`);
  const by = ['-CA', join(data, 'tls/authority.pem'), '-CAkey', join(data, 'tls/authority.key')];
  openssl(
    ...['x509', '-req', '-in', file('csr'), ...by, '-days', '5', '-set_serial', '7'],
    ...['-extfile', file('ext'), '-out', file('pem')],
  );
  return { key: file('key'), pem: file('pem') };
}

/** What Chromium says of a page with such a certificate; empty: it opens it. */
async function opened(context, home, address) {
  const { key, pem } = forge(context, address);
  context.network.add(address);
  const words = [
    's_server',
    '-accept',
    `${address}:4433`,
    '-cert',
    pem,
    '-key',
    key,
    '-www',
    '-quiet',
  ];
  const [command, ...rest] = [...context.prefix, 'openssl', ...words];
  const thief = spawn(command, rest, { stdio: 'ignore' });
  await new Promise((resolve) => setTimeout(resolve, 1000));
  const options = { home, prefix: context.prefix };
  const page = await Expert.open(context.chromium, `https://${address}:4433/`, options).catch(
    (error) => error,
  );
  thief.kill();
  if (page instanceof Error) return page.message.split('\n')[0];
  await page.close();
  return '';
}

export async function checkConstraints(context, home) {
  const inside = await opened(context, home, PRIVATE);
  context.check('the root vouches for private addresses', inside === '', inside || 'opened');
  const outside = await opened(context, home, PUBLIC);
  const refused = /ERR_CERT/.test(outside);
  context.check('and for no address that it was not made for', refused, outside || 'opened');
}
