import { pageNowMs } from '../session/clock';
import { newUuid } from '../session/edits';
import { KeptSession } from '../session/kept_session';
import { Session, type SessionOptions } from '../session/session';
import { Tabs } from '../session/tabs';
import { createClients } from '../transport/clients';
import { letGoOfButtons, tabStorage } from './dom';
import { Player } from './player';

/** What a page shows of a session. */
interface Page {
  readonly element: HTMLElement;
  start(): void;
}

/** Joins the server that this page came from, and shows what it tells until the page is left. */
export function startPage(
  options: Pick<SessionOptions, 'role' | 'view' | 'name'>,
  makePage: (session: Session, player: Player) => Page,
): void {
  const player = new Player();
  const kept = new KeptSession(tabStorage(), options.role, !reloaded());
  const tabs = new Tabs(new BroadcastChannel('saccade'), newUuid(), openedMs(tabStorage()));
  const session = new Session(createClients(location.origin), { ...options, kept, tabs }, player);
  player.attach(session);
  const page = makePage(session, player);
  document.body.append(page.element);
  page.start();
  const leaving = new AbortController();
  window.addEventListener('pagehide', () => {
    leaving.abort();
    tabs.leave();
  });
  letGoOfButtons();
  // Back from the browser's page cache: the session was left, so begin again.
  window.addEventListener('pageshow', (event) => {
    if (event.persisted) location.reload();
  });
  void session.run(leaving.signal);
}

const OPENED = 'saccade.opened';

/** When this tab was opened: a reload keeps its place among the tabs of this browser. */
function openedMs(storage: ReturnType<typeof tabStorage>): number {
  const kept = reloaded() ? Number(storage.getItem(OPENED)) : 0;
  const opened = kept > 0 ? kept : pageNowMs();
  try {
    storage.setItem(OPENED, String(opened));
  } catch {
    // Full: then a reload goes to the end of the queue.
  }
  return opened;
}

function reloaded(): boolean {
  const [entry] = performance.getEntriesByType('navigation') as PerformanceNavigationTiming[];
  return entry?.type === 'reload';
}
