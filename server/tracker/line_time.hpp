#pragma once

#include <algorithm>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// When a pixel is exposed, in read-outs after mid-exposure: -1/2 to 1/2.
///
/// A sensor reads its lines one after the other, and they run along its longer side. A picture that
/// stands upright was turned: its lines are columns, and its read-out time is negative where they
/// were read from the right.
inline double LateInReadouts(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const bool upright = camera.height() > camera.width();
  const double along =
      upright ? (pixel.x() + 0.5) / camera.width() : (pixel.y() + 0.5) / camera.height();
  return std::clamp(along, 0.0, 1.0) - 0.5;
}

}  // namespace saccade
