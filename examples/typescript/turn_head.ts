// Turns the head that carries the camera to a point of the world, and holds it there for a while.
//
//   node dist/turn_head.js [URL [X Y Z [SECONDS]]]
import { type Client, ConnectError, createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { setTimeout as sleep } from 'node:timers/promises';
import { GazeService, type GazeState } from './gen/saccade/v1/gaze_pb.js';
import { Role, SessionService } from './gen/saccade/v1/session_pb.js';
import { TrackingStatus } from './gen/saccade/v1/tracking_pb.js';

const heartbeatMs = 100; // the server takes a pilot for gone after 500 ms without a call
const arriveWithinMs = 20_000;
const degree = Math.PI / 180;

interface Point {
  x: number;
  y: number;
  z: number;
}

/** Until the camera is tracked: without its pose nobody knows where a point of the world is. */
async function waitForTracking(session: Client<typeof SessionService>): Promise<void> {
  for (const end = Date.now() + arriveWithinMs; ; ) {
    const { pose } = await session.getStatus({});
    if (pose?.status === TrackingStatus.TRACKING) return;
    if (Date.now() >= end) throw new Error(`not tracking: ${pose?.advice ?? 'no frame yet'}`);
    await sleep(heartbeatMs);
  }
}

/** Holds the lease, and with it the head: calls `done` at every heartbeat until it returns true. */
async function pilot(
  gaze: Client<typeof GazeService>,
  sessionId: string,
  leaseId: string,
  done: (state: GazeState) => boolean,
): Promise<void> {
  for (;;) {
    const lease = await gaze.acquireLease({ sessionId, leaseId });
    if (!lease.granted) throw new Error(`${lease.pilot?.displayName ?? 'somebody'} took the head`);
    const { state } = await gaze.getState({});
    if (state && done(state)) return;
    await sleep(heartbeatMs);
  }
}

async function turnHead(url: string, target: Point, holdMs: number): Promise<void> {
  const transport = createGrpcWebTransport({ baseUrl: url, defaultTimeoutMs: 5000 });
  const session = createClient(SessionService, transport);
  const gaze = createClient(GazeService, transport);
  const { sessionId } = await session.join({ displayName: 'turn_head', role: Role.EXPERT });
  await waitForTracking(session);

  const lease = await gaze.acquireLease({ sessionId });
  if (!lease.granted) throw new Error(`${lease.pilot?.displayName ?? 'somebody'} pilots the head`);
  try {
    await gaze.fixate({ sessionId, target: { target: { case: 'pointInWorldM', value: target } } });
    const latest = Date.now() + arriveWithinMs;
    let arrivedAt = 0;
    await pilot(gaze, sessionId, lease.leaseId, (state) => {
      if (state.unreachable) throw new Error('the joints do not reach that far');
      if (!arrivedAt && state.arrived) {
        arrivedAt = Date.now();
        console.log(`arrived, off by ${((state.errorRad ?? NaN) / degree).toFixed(2)} deg`);
      }
      if (!arrivedAt && Date.now() > latest) throw new Error(`did not arrive: ${state.problem}`);
      return arrivedAt > 0 && Date.now() - arrivedAt >= holdMs;
    });
  } finally {
    await gaze.releaseLease({ sessionId }); // others may want the head
  }
}

const [url = 'http://127.0.0.1:8080', x = '0.6', y = '0', z = '-0.2', seconds = '3'] =
  process.argv.slice(2);
try {
  await turnHead(url, { x: Number(x), y: Number(y), z: Number(z) }, 1000 * Number(seconds));
} catch (error) {
  console.error(`turn_head: ${error instanceof ConnectError ? error.rawMessage : String(error)}`);
  process.exitCode = 1;
}
