// The laser pointer from one hand to the other's eye, by stages that both pages tell (src/session/trace.ts):
// hand, sent, heard, drawn, and the screen's next frame.
import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { PointerKind, PointerService } from '../../src/gen/saccade/v1/pointer_pb.js';
import { Role } from '../../src/gen/saccade/v1/session_pb.js';
import { placeIn, shot, sleep } from './tools.mjs';

const NEAR_PX = 15; // the wearer sways: the same place is some pixels elsewhere a moment later
const STEP_MS = 350;

export const quantile = (values, q) =>
  [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(q * values.length))];

const ms = (values) =>
  values.length === 0
    ? '-'
    : `${quantile(values, 0.5).toFixed(0)} / ${quantile(values, 0.95).toFixed(0)}`;

/** Has a page keep what it tells of pointers, its frames, and where its own pointer went. */
const observe = (page) =>
  page.evaluate(() => {
    const seen = (window.told = { marks: [], frames: [], hands: [], on: true });
    const since = performance.timeOrigin;
    new window.PerformanceObserver((list) => {
      for (const { name, startTime, detail } of list.getEntries()) {
        if (seen.on && name.startsWith('saccade.pointer'))
          seen.marks.push({ name: name.split('.')[2], ms: since + startTime, detail });
      }
    }).observe({ type: 'mark' });
    const frame = () => {
      seen.frames.push(since + performance.now());
      if (seen.on) window.requestAnimationFrame(frame);
    };
    frame();
    const hand = ({ timeStamp, type, clientX, clientY }) => {
      const canvas = document.querySelector('canvas.picture');
      const box = canvas.getBoundingClientRect();
      const scale = box.width / canvas.width;
      const [u, v] = [(clientX - box.left) / scale - 0.5, (clientY - box.top) / scale - 0.5];
      if (seen.on) seen.hands.push({ ms: since + timeStamp, type, u, v });
    };
    for (const type of ['pointerrawupdate', 'pointermove', 'pointerup'])
      document.querySelector('.video').addEventListener(type, hand, { capture: true });
  });

const observed = (page) =>
  page.evaluate(() => {
    window.told.on = false;
    return window.told;
  });

const perSecond = ({ frames }) => (1000 * (frames.length - 1)) / (frames.at(-1) - frames[0]);

/** When a draw was on its way to the screen: at the next frame. */
const frameAfter = ({ frames }, at) => frames.find((each) => each >= at);

/** The stages of one move [ms], or undefined where the other never showed it. */
function stagesOf(hand, ann, bo) {
  const drawn = bo.marks.find(({ name, ms: at, detail }) => {
    const found = name === 'drawn' && /laser (-?[\d.]+) (-?[\d.]+)/.exec(detail);
    return found && at >= hand.ms && Math.hypot(found[1] - hand.u, found[2] - hand.v) < NEAR_PX;
  });
  const heard = bo.marks.findLast(({ name, ms: at }) => name === 'heard' && at <= drawn?.ms);
  const sent = ann.marks.find(({ name, ms: at }) => name === 'sent' && at >= hand.ms - 1);
  const frame = drawn && frameAfter(bo, drawn.ms);
  if (!heard || !sent || !frame || heard.ms < sent.ms) return undefined;
  return {
    hand: sent.ms - hand.ms,
    net: heard.ms - sent.ms,
    draw: drawn.ms - heard.ms,
    frame: frame - drawn.ms,
    all: frame - hand.ms,
  };
}

export async function laser(context) {
  const { ann, bo, check } = context;
  await ann.press('v');
  await ann.press('Escape');
  await ann.press('w');
  const steps = Array.from({ length: 24 }, (_, i) => [0.3 + 0.2 * (i % 3), 0.35 + 0.1 * (i % 4)]);
  await observe(ann.page);
  await observe(bo.page);
  await ann.page.mouse.move(...(await placeIn(ann, ...steps[0])));
  await ann.page.mouse.down();
  for (const step of steps.slice(1)) {
    await sleep(STEP_MS);
    await ann.page.mouse.move(...(await placeIn(ann, ...step)));
  }
  await sleep(400);
  await shot(context, 'laser-seen', bo);
  await ann.page.mouse.up();
  await sleep(1500);
  const [mine, others] = [await observed(ann.page), await observed(bo.page)];
  const moves = mine.hands.filter(
    ({ type, u, v }, i, all) =>
      type !== 'pointerup' && (u !== all[i - 1]?.u || v !== all[i - 1]?.v), // the frame's event says it again
  );
  const stages = moves.map((hand) => stagesOf(hand, mine, others)).filter(Boolean);
  const up = mine.hands.findLast(({ type }) => type === 'pointerup')?.ms ?? Infinity;
  const gone = others.marks.find(({ name, ms: at }) => name === 'heard' && at > up);
  const of = (name) => stages.map((each) => each[name]);
  const own = stages.map(({ hand, draw }) => hand + draw);
  check(
    'the laser is seen by the other, and gone when it is let go',
    stages.length > 12 && gone !== undefined && quantile(own, 0.5) < 50,
    `${stages.length} of ${moves.length} seen, p50 / p95 ms: hand to sent ${ms(of('hand'))}, to heard ${ms(of('net'))}, ` +
      `to drawn ${ms(of('draw'))}, to the next frame ${ms(of('frame'))}; all ${ms(of('all'))} ` +
      `(pages of ${perSecond(mine).toFixed(1)} and ${perSecond(others).toFixed(1)} frames a second on two cores); ` +
      `gone after ${gone ? (gone.ms - up).toFixed(0) : '-'} ms`,
  );
  await ann.press('v');
  await fromOutside(context);
}

/** The same by one page alone: a program points, the page shows it. */
async function fromOutside(context) {
  const { ann, check, session, url } = context;
  const pointers = createClient(PointerService, createGrpcWebTransport({ baseUrl: url }));
  const { sessionId } = await session.join({ displayName: 'Di', role: Role.EXPERT });
  await observe(ann.page);
  const sent = [];
  const strokeId = globalThis.crypto.randomUUID();
  const { map } = await context.map.get({});
  const at = map.upserted.find(({ depthKnown }) => depthKnown).pointInWorldM;
  for (let i = 0; i < 24; ++i) {
    const value = { x: at.x + 0.02 * (i % 5), y: at.y, z: at.z };
    sent.push(Date.now());
    await pointers.point({
      ...{ sessionId, strokeId, kind: PointerKind.LASER, released: i === 23 },
      points: [{ target: { case: 'pointInWorldM', value } }],
    });
    await sleep(STEP_MS);
  }
  await sleep(500);
  const told = await observed(ann.page);
  const rows = sent.flatMap((from) => {
    const heard = told.marks.find(({ name, ms: at }) => name === 'heard' && at >= from);
    const drawn =
      heard && told.marks.find(({ name, ms: at }) => name === 'drawn' && at >= heard.ms);
    const frame = drawn && frameAfter(told, drawn.ms);
    return frame ? [{ net: heard.ms - from, draw: drawn.ms - heard.ms, all: frame - from }] : [];
  });
  const of = (name) => rows.map((each) => each[name]);
  check(
    'a laser from a program without a browser is shown by the page',
    rows.length > 12,
    `${rows.length} of ${sent.length}, p50 / p95 ms: to heard ${ms(of('net'))}, to drawn ${ms(of('draw'))}, ` +
      `all to the next frame ${ms(of('all'))} (${perSecond(told).toFixed(1)} frames a second)`,
  );
}
