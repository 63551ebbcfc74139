#include "server/tracker/present_motion.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr double kShortest_s = 1.0 / 120.0;  // a shorter step tells more of errors than of motion
constexpr double kLongestImpulse_s = 1.0 / 30.0;  // FilterState::Predict splits longer steps

/// Of a change of velocity, the part that happened in the step; the rest had not been known before.
double ShareOfStep(const Eigen::Matrix3d& variance, double acceleration, double dt) {
  const double allowed = acceleration * acceleration * dt * std::min(dt, kLongestImpulse_s);
  return std::clamp(3.0 * allowed / std::max(1e-12, variance.trace()), 0.0, 1.0);
}

}  // namespace

CameraMotion PresentMotion(const FilterState& filter, const Rigid3& pose, const MotionStep& step) {
  CameraMotion motion = filter.WholeMotion();
  if (filter.inertial()) {  // a unit measures it better
    motion.world_from_camera = pose;
    return motion;
  }
  if (step.dt < kShortest_s) return motion;
  const Rigid3 expected = motion.world_from_camera;
  const Matrix12d covariance = filter.CameraCovariance();
  // The new mean is that of the middle of the step; the change goes on until its end.
  const auto gain = [&](int offset, double acceleration) {
    const Eigen::Matrix3d variance = covariance.block<3, 3>(offset, offset);
    return (1.0 + 0.5 * ShareOfStep(variance, acceleration, step.dt)) / step.dt;
  };
  motion.velocity_m_s +=
      gain(6, step.noise.acceleration_m_s2) * (pose.translation - expected.translation);
  motion.angular_velocity_rad_s += gain(9, step.noise.angular_acceleration_rad_s2) *
                                   LogQuaternion(expected.rotation.conjugate() * pose.rotation);
  motion.world_from_camera = pose;
  return motion;
}

}  // namespace saccade
