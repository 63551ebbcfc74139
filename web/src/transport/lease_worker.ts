import { createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { GazeService } from '../gen/saccade/v1/gaze_pb';
import { bearing } from './access';
import type { FromKeeper, ToKeeper } from './lease_keeper';
import { HEARTBEAT_MS, LeaseLoop } from './lease_loop';

/*
 * Heartbeats off the main thread: a page that draws, or is in the background, must not lose the head
 * by a late one. It lives and dies with its page.
 */
const post = (message: FromKeeper): void => self.postMessage(message);
let loop: LeaseLoop | undefined;
let ending = false;

function begin(baseUrl: string, sessionId: string, token: string): void {
  const interceptors = [bearing(() => token)];
  const client = createClient(GazeService, createGrpcWebTransport({ baseUrl, interceptors }));
  loop = new LeaseLoop(
    (session, lease) =>
      client.acquireLease({ sessionId: session, leaseId: lease }, { timeoutMs: 2000 }),
    sessionId,
    (told) => post({ kind: 'told', told }),
    performance.now(),
  );
  loop.beat(performance.now());
  setInterval(() => {
    if (!ending) loop?.beat(performance.now());
    else if (loop?.end()) post({ kind: 'ended' });
  }, HEARTBEAT_MS);
}

self.addEventListener('message', ({ data: message }: MessageEvent<ToKeeper>) => {
  switch (message.kind) {
    case 'begin':
      begin(message.baseUrl, message.sessionId, message.token);
      break;
    case 'alive':
      loop?.alive(performance.now());
      break;
    case 'end':
      ending = true;
      if (!loop || loop.end()) post({ kind: 'ended' });
      break;
  }
});
