import { Session, type SessionOptions } from '../session/session';
import { createClients } from '../transport/clients';
import { Player } from './player';

/** What a page shows of a session. */
interface Page {
  readonly element: HTMLElement;
  start(): void;
}

/** Joins the server that this page came from, and shows what it tells until the page is left. */
export function startPage(
  options: SessionOptions,
  makePage: (session: Session, player: Player) => Page,
): void {
  const player = new Player();
  const session = new Session(createClients(location.origin), options, player);
  player.attach(session);
  const page = makePage(session, player);
  document.body.append(page.element);
  page.start();
  const leaving = new AbortController();
  window.addEventListener('pagehide', () => leaving.abort());
  // Back from the browser's page cache: the session was left, so begin again.
  window.addEventListener('pageshow', (event) => {
    if (event.persisted) location.reload();
  });
  void session.run(leaving.signal);
}
