import { isOwn, type Mine, roleOf } from '../session/me';
import type { Annotation } from '../session/types';

/** Why this person changes nothing at all; undefined: may. */
export const whyNotEdit = (session: Mine): string | undefined =>
  roleOf(session) === 'viewer'
    ? 'You are a viewer: you see everything and change nothing. Ask for another invite.'
    : undefined;

/** Why this mark is not theirs to change; undefined: it is. The server decides, this says so before it. */
export function whyNotChange(session: Mine, annotation: Annotation): string | undefined {
  const why = whyNotEdit(session);
  if (why !== undefined) return why;
  const { locked, author } = annotation;
  if (!locked || isOwn(session, annotation) || roleOf(session) === 'wearer') return undefined;
  return `Locked by ${author}: only ${author} and the wearer change it.`;
}
