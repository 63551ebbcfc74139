import type { Annotation, Participant, Role } from './types';

/** Of a session, what says who sits here. */
interface Mine {
  readonly participants: readonly Participant[];
  readonly participantId: string;
  readonly joined: { readonly personId: string } | undefined;
}

/** This page's role as the server has it: an invite may give less than the page asked for. */
export const roleOf = ({ participants, participantId }: Mine): Role | undefined =>
  participants.find((each) => each.participantId === participantId)?.role;

/** Who I am for others, whichever page I sit at; empty: not known yet. */
export const personIdOf = ({ joined }: Pick<Mine, 'joined'>): string => joined?.personId ?? '';

/** True if the person who sits here has made it. */
export const isOwn = (session: Pick<Mine, 'joined'>, { authorPersonId }: Annotation): boolean =>
  authorPersonId !== '' && authorPersonId === personIdOf(session);

export type { Mine };
