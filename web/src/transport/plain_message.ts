/** What the server says to a program, and what a person is told: who looks at a page knows no fields. */
const SAYINGS: readonly (readonly [RegExp, string])[] = [
  [
    /^access: this server lets in who has an invite.*/,
    'you need an invite: ask for a link, and open it',
  ],
  [
    /^access: this invite is not known here.*/,
    'this server does not know this invite: was the whole link copied? Else ask for a new one',
  ],
  [
    /^access: this takes the role (\w+), and yours is (\w+).*/,
    'your invite is for a $2, and this takes the role $1: ask for another invite',
  ],
  [/^session_id: unknown/, 'the server no longer knows this session; the page begins a new one'],
  [/^session_id: this session has no stream/, 'this page is not connected now'],
  [/^session_id: a viewer changes nothing.*/, 'viewers change nothing'],
  [/frame_pixel\.pixel\b.*cannot be inverted/, 'that is too near to the edge of the lens'],
  [/frame_pixel\.pixel\b/, 'that is outside the picture: click inside it'],
  [
    /^frame \d+ (is no longer kept|was dropped|has not been captured)/,
    'that picture is no longer kept: click in a newer one',
  ],
  [/^the map was reset after frame/, 'the map was reset after that picture: click in a newer one'],
  [/feature_id\b.*not in the map/, 'that feature is no longer in the map: click again'],
  [
    /text\b.*?(\d+) bytes; at most (\d+)/,
    'the text has $1 bytes, and at most $2 are kept: shorten it',
  ],
  [
    /text: at most (\d+) bytes, not (\d+)/,
    'the text has $2 bytes, and at most $1 are kept: shorten it',
  ],
  [/^id '.*' is no annotation/, 'that mark is no longer there'],
  [/annotation_id\b.*does not exist/, 'that mark is no longer there, or its place is not known'],
  [/^this session has nothing to (undo|redo)/, 'you have nothing to $1'],
  [/^gaze: acquire the lease first/, 'you do not pilot the camera'],
  [/^gaze: no mount/, 'this camera is fixed to the wearer: ask them to turn'],
  [/^lease_id: is no longer in force/, 'the lease has ended'],
];

const FIELD = /^[a-z][a-z0-9_]*(\[\d+\])?(\.[a-z0-9_]+(\[\d+\])?)*: /;
const NAME = /\b[a-z0-9]+(?:_[a-z0-9]+)+\b(?:\.[a-z_]+)*/g;

/** The server's message without names of fields, which mean nothing on a page. */
export function plainMessage(message: string): string {
  for (const [pattern, words] of SAYINGS) {
    const found = pattern.exec(message);
    if (found) return words.replace(/\$(\d)/g, (_, n: string) => found[Number(n)] ?? '');
  }
  return message.replace(FIELD, '').replace(NAME, (name) => name.replace(/[_.]/g, ' '));
}
