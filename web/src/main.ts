import { recallName } from './session/name';
import { App } from './ui/app';
import { storage } from './ui/dom';
import { startPage } from './ui/start';

startPage(
  { role: 'expert', view: 'raw', name: recallName(location.search, storage()) },
  (session, player, token) => new App(session, player, token),
);
