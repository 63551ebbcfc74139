#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What a virtual pinhole camera `view` with the same optic centre, turned by `camera_from_view`,
/// sees of `picture` (taken by `camera`, through its lens): without distortion, black where the
/// picture ends. Any thread.
cv::Mat CropView(const cv::Mat& picture, const CameraModel& camera, const CameraIntrinsics& view,
                 const Eigen::Quaterniond& camera_from_view);

/// An arrow at the picture's edge that tells the wearer where to turn: `angle_rad` from straight
/// right, clockwise. Readable in sunlight: light on a dark halo.
void DrawGuidance(double angle_rad, cv::Mat& picture);

}  // namespace saccade
