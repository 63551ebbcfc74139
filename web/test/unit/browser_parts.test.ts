import { execFileSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { expect, test } from 'vitest';

const FOLDER = join(__dirname, '../browser');

// Parts that run on demand alone are not to break unseen when what they import is renamed. In node itself, for
// to it a name that is not there is an error.
test('every part of the browser test finds what it imports', () => {
  const files = readdirSync(FOLDER).filter((name) => name.endsWith('.mjs') && name !== 'run.mjs');
  expect(files.length).toBeGreaterThan(20);
  const lines = files.map((file) => `await import('${pathToFileURL(join(FOLDER, file)).href}');`);
  execFileSync(process.execPath, ['--input-type=module', '-e', lines.join('\n')]);
}, 30_000);
