import { Code, ConnectError } from '@connectrpc/connect';
import { plainMessage } from './plain_message';

/** What went wrong, in words for a person. */
export function plainWords(error: unknown): string {
  const connect = ConnectError.from(error);
  switch (connect.code) {
    case Code.Unavailable:
    case Code.Unknown:
      return isNetworkFailure(connect)
        ? 'no answer from the server'
        : plainMessage(connect.rawMessage);
    case Code.DeadlineExceeded:
      return 'the server did not answer in time';
    case Code.Unimplemented:
      return 'this server cannot do that yet';
    default:
      return plainMessage(connect.rawMessage) || `error ${Code[connect.code]}`;
  }
}

/** Why a stream, or the call before it, ended. */
export function streamEndWords(error: unknown): string {
  const { code, rawMessage } = ConnectError.from(error);
  if (isReplaced(error)) return 'this session goes on in another tab';
  // Not of this page's making: the server has waited for a sign of life, and ends what gives none.
  if (code === Code.DeadlineExceeded && !/timed out/.test(rawMessage)) {
    return 'the server heard nothing from this page for too long';
  }
  return plainWords(error);
}

/** True where the request itself was refused: trying again cannot help. */
export function isRefusal(error: unknown): boolean {
  const { code } = ConnectError.from(error);
  return [Code.InvalidArgument, Code.PermissionDenied, Code.Unauthenticated].includes(code);
}

/** True where another stream of the same session has taken this one's place. */
export const isReplaced = (error: unknown): boolean =>
  ConnectError.from(error).code === Code.Aborted;

/** True where what was named is not kept (any more). */
export const isGone = (error: unknown): boolean => ConnectError.from(error).code === Code.NotFound;

function isNetworkFailure(error: ConnectError): boolean {
  return /fetch|network|load failed/i.test(error.rawMessage);
}
