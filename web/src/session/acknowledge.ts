import type { JoinResponse } from '../gen/saccade/v1/session_pb';
import type { Clients } from '../transport/clients';
import { Acknowledger } from './acknowledger';
import type { PictureSink } from './picture_sink';

/** Acknowledges a subscription's events, for as long as pictures are decoded as they come. */
export const acknowledge = (
  of: {
    readonly client: Clients['session'];
    readonly joined: JoinResponse;
    readonly pictures: PictureSink;
    readonly every: number;
  },
  signal: AbortSignal,
): Acknowledger =>
  new Acknowledger({
    every: of.every,
    mayProceed: () => !of.pictures.behind,
    send: async (sequence, requestKeyFrame) => {
      const { sessionId } = of.joined;
      const request = { sessionId, sequence, requestKeyFrame };
      await of.client.acknowledge(request, { signal, timeoutMs: 3000 });
    },
  });
