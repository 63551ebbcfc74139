import { pageNowMs } from '../session/clock';
import { newUuid } from '../session/uuid';
import { KeptSession } from '../session/kept_session';
import { personKey } from '../session/person';
import { Session } from '../session/session';
import type { SessionOptions } from '../session/session_options';
import { Tabs } from '../session/tabs';
import { Access, inviteOf } from '../transport/access';
import { createClients } from '../transport/clients';
import { type Return, takeReturn } from '../transport/sign_in';
import { h, letGoOfButtons, storage, tabStorage } from './dom';
import { Player } from './player';
import { SignInNotice } from './sign_in_notice';
import { WaitingRoom } from './waiting_room';

/** What a page shows of a session. */
interface Page {
  readonly element: HTMLElement;
  start(): void;
}

/** Joins the server that this page came from, and shows what it tells until the page is left. */
export function startPage(
  options: Pick<SessionOptions, 'role' | 'view' | 'name' | 'topics'>,
  makePage: (session: Session, player: Player, token: () => string) => Page,
): void {
  const signIn = takeSignIn();
  const access = new Access(
    location.origin,
    takeInvite(),
    tabStorage(),
    storage(),
    undefined,
    signIn,
  );
  const token = (): string => access.token;
  const enter: SessionOptions['enter'] = async (signal, name, waiting) => {
    const other = signIn !== undefined && !access.token && signIn.path !== location.pathname;
    await access.enter(signal, name, waiting);
    if (other && access.token) location.replace(signIn.path); // the page that went to sign in
  };
  const player = new Player();
  const kept = new KeptSession(tabStorage(), options.role, !reloaded());
  const tabs = new Tabs(new BroadcastChannel('saccade'), newUuid(), openedMs(tabStorage()));
  const clients = createClients(location.origin, token);
  const own = { personKey: personKey(storage()), kept, tabs, enter };
  const session = new Session(clients, { ...options, ...own }, player);
  player.attach(session);
  const page = makePage(session, player, token);
  document.body.append(page.element);
  void greet(access, session);
  page.start();
  const leaving = new AbortController();
  window.addEventListener('pagehide', () => {
    leaving.abort();
    tabs.leave();
  });
  letGoOfButtons();
  // Another invite in the address of a page that is open already.
  window.addEventListener('hashchange', () => {
    if (inviteOf(location.hash) !== undefined) location.reload();
  });
  // Back from the browser's page cache: the session was left, so begin again.
  window.addEventListener('pageshow', (event) => {
    if (event.persisted) location.reload();
  });
  void session.run(leaving.signal);
}

/** The invite of this link; it is gone from the address then, so that nobody copies it from there. */
function takeInvite(): string | undefined {
  const invite = inviteOf(location.hash);
  if (invite !== undefined)
    history.replaceState(history.state, '', location.pathname + location.search);
  return invite;
}

/** What the firm's provider sent back; it is gone from the address then. */
function takeSignIn(): Return | undefined {
  const back = takeReturn(location.search, tabStorage());
  if (back !== undefined) history.replaceState(history.state, '', location.pathname);
  return back;
}

/** What a page shows beside its own: that nothing is protected, and who wants to come in. */
async function greet(access: Access, session: Session): Promise<void> {
  const room = new WaitingRoom(access, session);
  document.body.append(room.element);
  room.start();
  const signIn = new SignInNotice(access, session);
  document.body.append(signIn.element);
  signIn.start();
  const told = await access.client.getAccess({}, { timeoutMs: 5000 }).catch(() => undefined);
  if (!told?.insecure) return;
  const words =
    'Insecure: started for laboratories, without TLS. Whoever is on this network sees and changes everything.';
  document.body.append(h('p', { class: 'insecure', role: 'alert' }, words));
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
