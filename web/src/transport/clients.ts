import { type Client, createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { bearing } from './access';
import { AnnotationService } from '../gen/saccade/v1/annotation_pb';
import { CalibrationService } from '../gen/saccade/v1/calibration_pb';
import { GazeService } from '../gen/saccade/v1/gaze_pb';
import { MapService } from '../gen/saccade/v1/map_pb';
import { PointerService } from '../gen/saccade/v1/pointer_pb';
import { RecordingService } from '../gen/saccade/v1/recording_pb';
import { SceneService } from '../gen/saccade/v1/scene_pb';
import { SessionService } from '../gen/saccade/v1/session_pb';
import { SurfaceService } from '../gen/saccade/v1/surface_pb';
import { TalkService } from '../gen/saccade/v1/talk_pb';

export interface Clients {
  readonly session: Client<typeof SessionService>;
  readonly annotations: Client<typeof AnnotationService>;
  readonly calibration: Client<typeof CalibrationService>;
  readonly map: Client<typeof MapService>;
  readonly gaze: Client<typeof GazeService>;
  readonly pointers: Client<typeof PointerService>;
  readonly recording: Client<typeof RecordingService>;
  readonly scene: Client<typeof SceneService>;
  readonly surface: Client<typeof SurfaceService>;
  readonly talk: Client<typeof TalkService>;
}

/** gRPC-Web to the server that this page came from; `token` goes with each call, if there is one. */
export function createClients(baseUrl: string, token: () => string = () => ''): Clients {
  const interceptors = [bearing(token)];
  const transport = createGrpcWebTransport({ baseUrl, useBinaryFormat: true, interceptors });
  return {
    session: createClient(SessionService, transport),
    annotations: createClient(AnnotationService, transport),
    calibration: createClient(CalibrationService, transport),
    map: createClient(MapService, transport),
    gaze: createClient(GazeService, transport),
    pointers: createClient(PointerService, transport),
    recording: createClient(RecordingService, transport),
    scene: createClient(SceneService, transport),
    surface: createClient(SurfaceService, transport),
    talk: createClient(TalkService, transport),
  };
}
