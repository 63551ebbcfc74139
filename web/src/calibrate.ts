import { Topic } from './gen/saccade/v1/session_pb';
import { CalibrateApp } from './ui/calibrate_app';
import { startPage } from './ui/start';

startPage(
  {
    role: 'expert',
    view: 'raw',
    name: 'calibration',
    // No video: each picture comes with the corners that were found in it.
    topics: [Topic.PRESENCE, Topic.STATISTICS, Topic.PICTURE_PAUSE],
  },
  (session) => new CalibrateApp(session),
);
