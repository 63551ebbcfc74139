#include "server/eval/registration.hpp"

namespace saccade {

std::optional<RegistrationError> CompareRegistration(
    const CameraModel& camera, const Rigid3& true_world_from_camera,
    const Eigen::Vector3d& true_point, const Rigid3& estimated_world_from_camera,
    const std::optional<Eigen::Vector3d>& estimated_point) {
  const Eigen::Vector3d truth = true_world_from_camera.Inverse() * true_point;
  const auto true_pixel = camera.Project(truth);
  if (!true_pixel) return std::nullopt;
  RegistrationError error = {kNotDrawn_px, std::nullopt};
  if (!estimated_point) return error;
  const Eigen::Vector3d estimate = estimated_world_from_camera.Inverse() * *estimated_point;
  error.mm_per_m = 1e3 * (estimate - truth).norm() / truth.norm();
  // Behind the camera or beyond the lens: nothing is drawn.
  if (const auto pixel = camera.Project(estimate)) error.pixels = (*pixel - *true_pixel).norm();
  return error;
}

bool IsLost(const Rigid3& estimate, const Rigid3& truth) {
  return !((estimate.translation - truth.translation).norm() <= kLostPosition_m) ||
         !(RotationAngle(estimate, truth) <= kLostRotation_rad);
}

}  // namespace saccade
