import { Code, ConnectError } from '@connectrpc/connect';

/** What went wrong, in words for a person; the server's own message where it sent one. */
export function describeError(error: unknown): string {
  const connect = ConnectError.from(error);
  switch (connect.code) {
    case Code.Unavailable:
    case Code.Unknown:
      return isNetworkFailure(connect) ? 'no answer from the server' : connect.rawMessage;
    case Code.DeadlineExceeded:
      return 'the server did not answer in time';
    case Code.Unimplemented:
      return 'this server cannot do that yet';
    default:
      return connect.rawMessage || `error ${Code[connect.code]}`;
  }
}

/** The same without the name of the request's field, which means nothing on a page. */
export const plainWords = (error: unknown): string =>
  describeError(error).replace(/^[a-z][a-z_]*(\.[a-z_]+)*: /, '');

/** True where trying again cannot help: the request itself was refused. */
export function isRefusal(error: unknown): boolean {
  const { code } = ConnectError.from(error);
  return code === Code.InvalidArgument || code === Code.PermissionDenied;
}

/** True where what was named is not kept (any more). */
export const isGone = (error: unknown): boolean => ConnectError.from(error).code === Code.NotFound;

function isNetworkFailure(error: ConnectError): boolean {
  return /fetch|network|load failed/i.test(error.rawMessage);
}
