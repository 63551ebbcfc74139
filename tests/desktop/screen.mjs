// A screen of its own: Xvfb, whose pixels lie in a file, and input as from mouse and keyboard (XTest).
import { spawn, spawnSync } from 'node:child_process';
import { closeSync, openSync, readSync } from 'node:fs';
import { join } from 'node:path';

export class Screen {
  /** Starts one of `width` x `height` pixels; `folder` is its own. */
  static async start(folder, width, height) {
    const child = spawn(
      'Xvfb',
      [
        '-displayfd',
        '3',
        '-screen',
        '0',
        `${width}x${height}x24`,
        '-fbdir',
        folder,
        '-nolisten',
        'tcp',
      ],
      { stdio: ['ignore', 'ignore', 'ignore', 'pipe'] },
    );
    const number = await new Promise((resolve, reject) => {
      child.once('error', reject);
      child.once('exit', (code) => reject(new Error(`Xvfb ended with ${code}`)));
      child.stdio[3].once('data', (data) => resolve(String(data).trim()));
    });
    return new Screen(child, `:${number}`, join(folder, 'Xvfb_screen0'), width, height);
  }

  constructor(child, display, file, width, height) {
    this.child = child;
    this.display = display;
    this.width = width;
    this.height = height;
    this.file = openSync(file, 'r');
    const header = Buffer.alloc(100);
    readSync(this.file, header, 0, 100, 0);
    this.offset = header.readUInt32BE(0) + 12 * header.readUInt32BE(76); // and its colour map
    this.stride = header.readUInt32BE(48);
    this.buffer = Buffer.alloc(this.stride * height);
  }

  /** All pixels as they are now: {width, height, data (RGBA)}. */
  grab() {
    const { width, height, stride, buffer } = this;
    readSync(this.file, buffer, 0, buffer.length, this.offset);
    const data = new Uint8Array(4 * width * height);
    for (let y = 0, to = 0; y < height; ++y) {
      for (let from = y * stride, end = from + 4 * width; from < end; from += 4, to += 4) {
        data[to] = buffer[from + 2];
        data[to + 1] = buffer[from + 1];
        data[to + 2] = buffer[from];
        data[to + 3] = 255;
      }
    }
    return { width, height, data };
  }

  /** The bytes of some rows, for noticing that they have changed. */
  rows(first, count) {
    const bytes = Buffer.alloc(count * this.stride);
    readSync(this.file, bytes, 0, bytes.length, this.offset + first * this.stride);
    return bytes;
  }

  /** One call of xdotool: `mousemove 10 20 click 1`. */
  input(...words) {
    const { status, stderr } = spawnSync('xdotool', words.map(String), {
      env: { ...process.env, DISPLAY: this.display },
    });
    if (status !== 0) throw new Error(`xdotool ${words.join(' ')}: ${stderr}`);
  }

  click([x, y], button = 1) {
    this.input('mousemove', Math.round(x), Math.round(y), 'click', button);
  }

  move([x, y]) {
    this.input('mousemove', Math.round(x), Math.round(y));
  }

  press(...keys) {
    this.input('key', ...keys);
  }

  /** Writes a PNG of it. */
  shot(file) {
    spawnSync('import', ['-window', 'root', file], {
      env: { ...process.env, DISPLAY: this.display },
    });
  }

  stop() {
    closeSync(this.file);
    this.child.kill('SIGTERM');
  }
}
