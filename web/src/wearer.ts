import { Session } from './session/session';
import { createClients } from './transport/clients';
import { Player } from './ui/player';
import { WearerApp } from './ui/wearer_app';

const player = new Player();
const session = new Session(
  createClients(location.origin),
  { role: 'wearer', view: 'augmented', name: 'wearer' },
  player,
);
player.attach(session);
const app = new WearerApp(session, player);
document.body.append(app.element);
app.start();
const leaving = new AbortController();
window.addEventListener('pagehide', () => leaving.abort());
window.addEventListener('pageshow', (event) => {
  if (event.persisted) location.reload();
});
void session.run(leaving.signal);
