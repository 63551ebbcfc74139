#pragma once

#include <Eigen/Dense>
#include <optional>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// An anchor that is not drawn where truth is in view counts as this far off [px].
inline constexpr double kNotDrawn_px = 50.0;

/// How far one anchor is off in one frame.
struct RegistrationError {
  double pixels = 0;               // between the two projections; kNotDrawn_px if not drawn
  std::optional<double> mm_per_m;  // 3D error in the camera's frame per distance; drawn only
};

/// Compares the anchor as drawn, by the estimated pose, with the true point by the true pose
/// (architecture section 4). `estimated_point` is nothing if the anchor is not drawn. Nothing if
/// the lens cannot see the true point.
std::optional<RegistrationError> CompareRegistration(
    const CameraModel& camera, const Rigid3& true_world_from_camera,
    const Eigen::Vector3d& true_point, const Rigid3& estimated_world_from_camera,
    const std::optional<Eigen::Vector3d>& estimated_point);

/// A pose further than this from truth counts as lost.
inline constexpr double kLostPosition_m = 0.10;
inline constexpr double kLostRotation_rad = 5.0 * 3.14159265358979 / 180.0;

/// True if `estimate` is more than 10 cm or 5 deg from `truth`.
bool IsLost(const Rigid3& estimate, const Rigid3& truth);

}  // namespace saccade
