import { Topic } from './gen/saccade/v1/session_pb';
import { startPage } from './ui/start';
import { WearApp } from './ui/wear_app';

startPage(
  {
    role: 'wearer',
    view: 'raw',
    name: 'wearer',
    // No video: the pictures are this phone's own.
    topics: [
      ...[Topic.POSE, Topic.ANNOTATION, Topic.PRESENCE, Topic.STATISTICS, Topic.GAZE],
      ...[Topic.PICTURE_PAUSE, Topic.CHAT],
    ],
  },
  (session, _player, token) => new WearApp(session, token),
);
