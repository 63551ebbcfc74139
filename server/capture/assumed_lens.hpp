#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What a lens nobody measured is taken for: no distortion, so wide across `size` as it is before
/// any turn.
inline constexpr double kAssumedView_deg = 60.0;

/// For SourceInfo::remark, and the log.
std::string AssumedLensWords(double view_deg = kAssumedView_deg);

/// `size`: of the upright picture; `turned`: its sides are swapped against the sensor's.
CameraIntrinsics AssumedLens(cv::Size size, bool turned, double fps,
                             double view_deg = kAssumedView_deg);

}  // namespace saccade
