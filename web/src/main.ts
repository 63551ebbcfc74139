import { Session } from './session/session';
import { createClients } from './transport/clients';
import { App } from './ui/app';
import { Player } from './ui/player';

const name = new URLSearchParams(location.search).get('name')?.slice(0, 60) ?? 'expert';
const player = new Player();
const session = new Session(
  createClients(location.origin),
  { role: 'expert', view: 'raw', name },
  player,
);
player.attach(session);
const app = new App(session, player);
document.body.append(app.element);
app.start();
const leaving = new AbortController();
window.addEventListener('pagehide', () => leaving.abort());
// Back from the browser's page cache: the session was left, so begin again.
window.addEventListener('pageshow', (event) => {
  if (event.persisted) location.reload();
});
void session.run(leaving.signal);
