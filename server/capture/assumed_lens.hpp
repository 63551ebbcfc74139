#pragma once

#include <opencv2/core.hpp>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What a lens nobody measured is taken for: no distortion, so wide across `size` as it is before
/// any turn.
inline constexpr double kAssumedView_deg = 60.0;

/// For SourceInfo::remark, and the log.
inline constexpr char kAssumedLensWords[] =
    "lens assumed: 60 deg wide, no distortion, not metric; give --camera camera.yaml";

/// `size`: of the upright picture; `turned`: its sides are swapped against the sensor's.
CameraIntrinsics AssumedLens(cv::Size size, bool turned, double fps);

}  // namespace saccade
