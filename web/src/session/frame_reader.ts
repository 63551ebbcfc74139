import type { CameraIntrinsics } from '../gen/saccade/v1/geometry_pb';
import { type AccessUnit, VideoView } from '../gen/saccade/v1/video_pb';
import { Camera } from '../geometry/camera';
import { toFrameFeatures, toIntrinsics, toPose, toStages } from './convert';
import type { FrameFacts } from './types';

/** What is known of each frame, from the packet that brings its picture. */
export class FrameReader {
  private camera: Camera | undefined;

  /** Undefined where the lens is not known. `usual`: of a packet that names none. */
  read(
    unit: AccessUnit,
    usual: CameraIntrinsics | undefined,
    arrivedMs: number,
  ): FrameFacts | undefined {
    const pb = unit.intrinsics ?? usual;
    if (!pb) return undefined;
    const intrinsics = toIntrinsics(pb);
    if (!this.camera || JSON.stringify(this.camera.intrinsics) !== JSON.stringify(intrinsics)) {
      this.camera = new Camera(intrinsics);
    }
    return {
      frameId: Number(unit.frameId),
      view: unit.view === VideoView.AUGMENTED ? 'augmented' : 'raw',
      pose: unit.pose && toPose(unit.pose),
      camera: this.camera,
      features: unit.features && toFrameFeatures(unit.features),
      stages: toStages(unit.stages),
      arrivedMs,
    };
  }
}
