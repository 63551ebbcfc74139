#pragma once

#include <opencv2/core.hpp>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// Draws what is pinned up, `pixels` (BGR), into its outline, through the lens and upright. Nothing
/// where a corner is behind the camera or cannot be seen through the lens.
void DrawPinnedPicture(const CameraModel& camera, const Rigid3& world_from_camera,
                       const Annotation& annotation, const cv::Mat& pixels, cv::Mat& onto);

}  // namespace saccade
