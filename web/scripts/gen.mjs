// Generates src/gen from ../proto with Debian's protoc and the plugin in node_modules.
import { execFileSync } from 'node:child_process';
import { mkdirSync, readdirSync, rmSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const web = join(dirname(fileURLToPath(import.meta.url)), '..');
const proto = join(web, '..', 'proto');
const out = join(web, 'src', 'gen');

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
const files = readdirSync(join(proto, 'saccade', 'v1'))
  .filter((name) => name.endsWith('.proto'))
  .map((name) => `saccade/v1/${name}`);
try {
  execFileSync(
    'protoc',
    [
      `-I${proto}`,
      `--plugin=protoc-gen-es=${join(web, 'node_modules', '.bin', 'protoc-gen-es')}`,
      `--es_out=${out}`,
      // JavaScript with types, so that the browser test can import it as well.
      '--es_opt=target=js+dts,import_extension=js',
      ...files,
    ],
    { stdio: 'inherit' },
  );
} catch (error) {
  console.error(
    error.code === 'ENOENT'
      ? 'protoc not found: install protobuf-compiler (deploy/install does)'
      : `protoc failed: ${error.message}`,
  );
  process.exit(1);
}
