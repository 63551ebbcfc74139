import { recallName } from './session/name';
import { App } from './ui/app';
import { startPage } from './ui/start';

startPage(
  { role: 'expert', view: 'raw', name: recallName(location.search, localStorage) },
  (session, player) => new App(session, player),
);
