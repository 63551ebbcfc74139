// saccade-client in a real window, as its own trace tells what it shows.
import { spawn } from 'node:child_process';
import { closeSync, openSync, readFileSync, readSync, rmSync } from 'node:fs';
import { join } from 'node:path';

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export class Desktop {
  /** `args` beside --trace; `folder`: home, settings and trace. */
  static async start(binary, args, screen, folder) {
    const trace = join(folder, 'trace.jsonl');
    rmSync(trace, { force: true }); // of one before it
    const child = spawn(binary, [...args, '--trace', trace], {
      stdio: ['ignore', 'ignore', 'pipe'],
      env: {
        ...process.env,
        DISPLAY: screen.display,
        HOME: folder,
        XDG_CONFIG_HOME: join(folder, 'config'),
        XDG_STATE_HOME: join(folder, 'state'),
        XDG_DATA_HOME: join(folder, 'data-of-nobody'),
        XDG_PICTURES_DIR: folder,
        LIBGL_ALWAYS_SOFTWARE: '1',
        WAYLAND_DISPLAY: '',
      },
    });
    const desktop = new Desktop(child, screen);
    for (let i = 0; i < 200 && desktop.file === undefined; ++i) {
      if (desktop.code !== undefined) throw new Error(`saccade-client: ${desktop.errors}`);
      await sleep(100);
      try {
        desktop.file = openSync(trace, 'r');
      } catch {
        // not there yet
      }
    }
    await desktop.until('the first picture', (shown) => shown.video !== null, 60_000);
    return desktop;
  }

  errors = '';
  code = undefined;
  lines = []; // of pictures shown
  drawing = 0;
  #rest = '';
  #chunk = Buffer.alloc(1 << 20);

  constructor(child, screen) {
    this.child = child;
    this.screen = screen;
    child.stderr.on('data', (data) => (this.errors += data));
    this.exited = new Promise((resolve) =>
      child.once('exit', (code, signal) => {
        this.code = code ?? signal;
        resolve(this.code);
      }),
    );
  }

  #read() {
    if (this.code !== undefined)
      throw new Error(`saccade-client ended with ${this.code}: ${this.errors}`);
    for (;;) {
      const size = readSync(this.file, this.#chunk, 0, this.#chunk.length, null);
      if (size === 0) return;
      const lines = (this.#rest + this.#chunk.subarray(0, size).toString()).split('\n');
      this.#rest = lines.pop();
      for (const line of lines) {
        const told = JSON.parse(line);
        if (told.event === 'shown') this.lines.push(told);
        else this.drawing = told.seq;
      }
    }
  }

  /** What is on the screen now. */
  look() {
    this.#read();
    return this.lines.at(-1);
  }

  /** Waits until it shows something like that; what it then shows. */
  async until(what, wanted, timeoutMs = 10_000) {
    const end = Date.now() + timeoutMs;
    while (Date.now() < end) {
      if (this.file !== undefined) {
        const shown = this.look();
        if (shown && wanted(shown)) return shown;
      }
      await sleep(15);
    }
    throw new Error(`never: ${what}; ${JSON.stringify(this.lines.at(-1))?.slice(0, 3000)}`);
  }

  /**
   * The window's pixels and what they are of: taken between two pictures, as no drawing began and none ended
   * meanwhile. Undefined if one did.
   */
  grab() {
    const before = this.look();
    if (!before || this.drawing !== before.seq) return undefined;
    const picture = this.screen.grab();
    const after = this.look();
    return after === before && this.drawing === before.seq ? { shown: before, picture } : undefined;
  }

  async settledGrab() {
    for (const end = Date.now() + 30_000; Date.now() < end; await sleep(3)) {
      const got = this.grab();
      if (got) return got;
    }
    throw new Error('the window never stood still long enough to be read');
  }

  /** Makes a pane the large one. */
  async enlarge(pane) {
    if (this.look().main !== pane) this.screen.press('s');
    await this.until(`${pane} is large`, ({ main }) => main === pane);
  }

  /** Processor time so far [s] and resident memory [MiB]. */
  cost() {
    const stat = readFileSync(`/proc/${this.child.pid}/stat`, 'utf8');
    const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
    const status = readFileSync(`/proc/${this.child.pid}/status`, 'utf8');
    return {
      cpu_s: (Number(fields[11]) + Number(fields[12])) / 100,
      memory_mib: Number(/VmRSS:\s+(\d+)/.exec(status)[1]) / 1024,
    };
  }

  /** Ends it by a signal; how long that took [ms] and its exit code. */
  async stop(signal = 'SIGINT') {
    const begin = performance.now();
    this.child.kill(signal);
    const force = setTimeout(() => this.child.kill('SIGKILL'), 8000);
    const code = await this.exited;
    clearTimeout(force);
    if (this.file !== undefined) closeSync(this.file);
    return { ms: performance.now() - begin, code };
  }
}
