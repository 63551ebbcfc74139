// The real saccade-server as a child process, and what its simulator says is true.
import { execFile, spawn } from 'node:child_process';
import { closeSync, openSync, readFileSync, readSync } from 'node:fs';
import { join } from 'node:path';
import { promisify } from 'node:util';
import { decodeDepthPng, decodePng } from './pictures.mjs';

/** Starts a server; resolves when it serves. `http` is its page's address, `address` that without scheme. */
export async function startServer(binary, args, prefix = []) {
  const [command, ...rest] = [...prefix, binary, ...args];
  const child = spawn(command, rest, { stdio: ['ignore', 'pipe', 'pipe'] });
  let errors = '';
  child.stderr.on('data', (data) => {
    errors = (errors + data).slice(-4000);
  });
  const exited = new Promise((resolve) => child.once('exit', resolve));
  const ready = await new Promise((resolve, reject) => {
    let out = '';
    child.stdout.on('data', (data) => {
      out += data;
      const line = out.split('\n').find((text) => text.includes('"ready"'));
      if (line) resolve(JSON.parse(line));
    });
    child.once('error', reject);
    exited.then((code) => reject(new Error(`saccade-server ended with ${code}:\n${errors}`)));
  });
  return {
    http: `http://${ready.http}`,
    address: ready.http,
    grpc: ready.grpc,
    pid: child.pid,
    /** Ends it as a person would, then by force; returns how long it took [ms]. */
    async stop() {
      const begin = performance.now();
      child.kill('SIGTERM');
      const force = setTimeout(() => child.kill('SIGKILL'), 5000);
      await exited;
      clearTimeout(force);
      return performance.now() - begin;
    },
    errors: () => errors,
  };
}

/** `--sim-truth` by frame id, read as it grows. */
export class Truth {
  #file;
  #rest = Buffer.alloc(0);
  #chunk = Buffer.alloc(1 << 20);
  #frames = new Map();

  constructor(path) {
    this.#file = openSync(path, 'r');
  }

  /** Truth of a frame; undefined if the simulator has not made it. */
  frame(id) {
    if (!this.#frames.has(id)) this.#read();
    return this.#frames.get(id);
  }

  frames() {
    this.#read();
    return [...this.#frames.values()];
  }

  close() {
    closeSync(this.#file);
  }

  #read() {
    for (;;) {
      const size = readSync(this.#file, this.#chunk, 0, this.#chunk.length, null);
      if (size === 0) return;
      this.#rest = Buffer.concat([this.#rest, this.#chunk.subarray(0, size)]);
      for (let end; (end = this.#rest.indexOf(10)) >= 0; ) {
        const frame = JSON.parse(this.#rest.subarray(0, end).toString());
        this.#rest = this.#rest.subarray(end + 1);
        this.#frames.set(frame.frame, frame);
      }
    }
  }
}

/** Draws the simulator's frame `id` as it is without noise; where its files are, without their endings. */
async function rendered(evaluator, source, id, out, ...flags) {
  const frames = ['--frames', `${id}:${id + 1}`];
  await promisify(execFile)(evaluator, [
    ...['render', '--source', source, ...frames, '--out', out, ...flags],
  ]);
  return join(out, String(id).padStart(6, '0'));
}

/** The simulator's frame `id` as it is without noise, drawn by saccade-eval. */
export async function renderTruth(evaluator, source, id, out) {
  return decodePng(readFileSync(`${await rendered(evaluator, source, id, out)}.png`));
}

/** How far off everything in frame `id` is: decodeDepthPng of what saccade-eval drew. */
export async function renderDepths(evaluator, source, id, out) {
  return decodeDepthPng(
    readFileSync(`${await rendered(evaluator, source, id, out, '--depth')}.depth.png`),
  );
}
