// A person at the page: looks at pixels, moves the mouse, presses keys. Nothing is injected.
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const FLAGS = [
  '--no-sandbox', // the tests may run as root
  '--no-first-run',
  '--disable-quic',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--use-gl=angle',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
];

/**
 * Root's Chromium puts its software GPU above every other process, as no person's can: on two cores the
 * server got 5 to 9 pictures a second. Here it may not.
 */
function withoutPriority(executablePath, folder, prefix) {
  const without = ['setpriv', '--bounding-set', '-sys_nice'];
  const root = spawnSync(without[0], [...without.slice(1), 'true']).status === 0;
  if (!root && prefix.length === 0) return executablePath;
  const script = join(folder, 'chromium');
  const words = [...prefix, ...(root ? without : [])];
  const line = `exec ${words.join(' ')} '${executablePath}' "$@"`;
  writeFileSync(script, `#!/bin/sh\n${line}\n`, { mode: 0o755 });
  return script;
}

export class Expert {
  /**
   * `home`: whose certificates count; `prefix`: a command that runs the browser elsewhere; `flags`: more of
   * the browser's; `viewport`: of the page; `nameless`: who sits there is asked for a name;
   * `firstTime`: the page offers its first task; `look`: what the map shows, dots where not said (tests click dots,
   * and software GPUs have enough to do); `init`: runs in the page before anything of its own.
   */
  static async open(
    executablePath,
    url,
    {
      home = process.env['HOME'],
      prefix = [],
      flags = [],
      viewport = { width: 1280, height: 720 },
      nameless = false,
      firstTime = false,
      look = 'dots',
      init,
    } = {},
  ) {
    const profile = mkdtempSync(join(tmpdir(), 'saccade-browser-'));
    const context = await chromium.launchPersistentContext(profile, {
      executablePath: withoutPriority(executablePath, profile, prefix),
      args: [...FLAGS, ...flags],
      env: { ...process.env, HOME: home },
      viewport,
      bypassCSP: init !== undefined, // else what `init` loads would be refused
    });
    if (init) await context.addInitScript(init);
    const page = context.pages()[0] ?? (await context.newPage());
    const expert = new Expert(context, page, profile);
    // Somebody who has been here before: no first task in the way.
    if (!firstTime) {
      await context.addInitScript(() => {
        if (window.location.origin !== 'null') localStorage.setItem('saccade.firstTask', 'done');
      });
    }
    await context.addInitScript((kept) => {
      if (window.location.origin === 'null' || localStorage.getItem('saccade.mapLook')) return;
      localStorage.setItem('saccade.mapLook', kept);
    }, look);
    page.on('pageerror', (error) => expert.errors.push(error.message));
    const address = new URL(url);
    if (!nameless && !address.searchParams.has('name')) address.searchParams.set('name', 'expert');
    await page.goto(address.href);
    return expert;
  }

  errors = [];

  constructor(context, page, profile) {
    this.context = context;
    this.page = page;
    this.profile = profile;
  }

  async close() {
    await this.context.close();
    rmSync(this.profile, { recursive: true, force: true });
  }

  /** Waits until the status reads like this. */
  async waitForStatus(pattern, timeout) {
    await this.page
      .locator('header .status strong', { hasText: pattern })
      .waitFor({ timeout })
      .catch(async () => {
        const text = await this.page.locator('header').innerText();
        throw new Error(`status never matched ${pattern}: ${text.replace(/\n/g, ' | ')}`);
      });
  }

  press(key) {
    return this.page.keyboard.press(key);
  }

  /** Pictures a second that the server tracks, as the page says. */
  async trackedHz() {
    const text = await this.page.locator('footer .losses').innerText();
    return Number(/tracked (\d+) Hz/.exec(text)?.[1] ?? 0);
  }

  /** Makes a pane the large one. */
  async enlarge(pane) {
    const main = this.page.locator('main');
    if ((await main.getAttribute('data-main')) !== pane) await this.press('s');
    await this.page.locator(`main[data-main="${pane}"]`).waitFor();
    await this.page.waitForTimeout(300); // and drawn so
  }

  /** Picture on the canvas and the frame it is said to be, read in one go. */
  async picture() {
    const { id, url } = await this.page.evaluate(() => {
      const canvas = document.querySelector('canvas.picture');
      return { id: Number(canvas.dataset.frameId), url: canvas.toDataURL('image/png') };
    });
    return { id, png: Buffer.from(url.split(',')[1], 'base64') };
  }

  /** Marks drawn over the video, their frame, and where the picture lies under them. */
  async marks() {
    const { url, ...rest } = await this.page.evaluate(() => {
      const canvas = document.querySelector('.video canvas.marks');
      const picture = document.querySelector('canvas.picture');
      const box = canvas.getBoundingClientRect();
      const under = picture.getBoundingClientRect();
      return {
        id: Number(canvas.dataset.frameId),
        url: canvas.toDataURL('image/png'),
        left: under.left - box.left,
        top: under.top - box.top,
        scale: under.width / picture.width,
        ratio: canvas.width / box.width,
      };
    });
    return { ...rest, png: Buffer.from(url.split(',')[1], 'base64') };
  }

  /** The frame on the screen and where its picture lies on the page. */
  look() {
    return this.page.evaluate(() => {
      const canvas = document.querySelector('canvas.picture');
      const box = canvas.getBoundingClientRect();
      const { width, height, dataset } = canvas;
      return {
        id: Number(dataset.frameId),
        left: box.left,
        top: box.top,
        scale: box.width / width,
        width,
        height,
      };
    });
  }

  /** The eye above the map, as the page says it draws, and where the map lies. */
  mapView() {
    return this.page.evaluate(() => {
      const canvas = document.querySelector('canvas.map');
      const box = canvas.getBoundingClientRect();
      const [x, y, z, ...rotation] = canvas.dataset.eye.split(' ').map(Number);
      return {
        pose: { translation_m: [x, y, z], rotation_xyzw: rotation },
        focal: Number(canvas.dataset.focalPx),
        left: box.left,
        top: box.top,
        width: box.width,
        height: box.height,
      };
    });
  }

  /** True if a click there meets this pane and not something above it. */
  isOver(pane, [x, y]) {
    return this.page.evaluate(
      ([selector, left, top]) => Boolean(document.elementFromPoint(left, top)?.closest(selector)),
      [pane, x, y],
    );
  }

  async click([x, y]) {
    await this.page.mouse.move(x, y);
    await this.page.mouse.down();
    await this.page.mouse.up();
  }

  /** Frame and pixel of the last press on the video. */
  async pressed() {
    const text = await this.page.locator('.video').getAttribute('data-pressed');
    const [id, u, v] = text.split(' ').map(Number);
    return { id, pixel: [u, v] };
  }

  annotationIds() {
    return this.page.evaluate(() =>
      [...document.querySelectorAll('aside li')].map((li) => li.dataset.id),
    );
  }

  /** Why a mark was not placed, as long as the page says so. */
  refusal() {
    return this.page.evaluate(() =>
      [...document.querySelectorAll('.pane-note')]
        .map((p) => p.textContent)
        .find((t) => t.startsWith('Not placed')),
    );
  }

  /** Waits for a mark that was not there before; its id, or why there is none. */
  async newAnnotation(before, timeoutMs = 8000) {
    const end = Date.now() + timeoutMs;
    while (Date.now() < end) {
      const id = (await this.annotationIds()).find((known) => !before.includes(known));
      if (id) return { id };
      const note = await this.refusal();
      if (note) {
        // It stands for some seconds: the next mark must not be taken for refused as well.
        while ((await this.refusal()) && Date.now() < end) await this.page.waitForTimeout(100);
        return { refused: note };
      }
      await this.page.waitForTimeout(20);
    }
    return { refused: 'no answer' };
  }
}
