#pragma once

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// A camera without distortion that looks through the middle of its picture; focal length [px].
inline CameraIntrinsics Pinhole(int width, int height, double focal_px) {
  CameraIntrinsics intrinsics;
  intrinsics.width = width;
  intrinsics.height = height;
  intrinsics.fx = intrinsics.fy = focal_px;
  intrinsics.cx = 0.5 * (width - 1);
  intrinsics.cy = 0.5 * (height - 1);
  return intrinsics;
}

}  // namespace saccade
