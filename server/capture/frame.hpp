#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "server/mount/mount_angles.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// One picture on its way through the pipeline. Immutable once captured; images are shared.
struct Frame {
  FrameId id = 0;                  // position in the source, from 0; gaps mean dropped frames
  Timestamp capture_time_ns = 0;   // exposure middle, capture clock (drives the filter)
  Timestamp received_time_ns = 0;  // MonotonicNow() when the picture was complete (latency)
  std::string source_timestamp;    // text of the data set's time stamp, empty for live sources
  cv::Mat grey;                    // CV_8UC1, never empty
  cv::Mat color;                   // CV_8UC3 BGR, or empty if the source is grey
  std::shared_ptr<const CameraModel> camera;
  /// By the encoders, at capture_time_ns; absent: the camera is fixed, or its encoders are silent.
  std::optional<MountAngles> mount;
};

}  // namespace saccade
