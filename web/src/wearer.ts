import { startPage } from './ui/start';
import { WearerApp } from './ui/wearer_app';

startPage(
  { role: 'wearer', view: 'augmented', name: 'wearer' },
  (session, player) => new WearerApp(session, player),
);
