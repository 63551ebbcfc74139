#pragma once

#include <Eigen/Dense>
#include <cmath>

namespace saccade {

/// Cross-product matrix: Skew(a) * b == a.cross(b).
inline Eigen::Matrix3d Skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Exponential map of SO(3): rotation vector [rad] to unit quaternion (Hamilton).
inline Eigen::Quaterniond ExpQuaternion(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  // sin(x/2)/x to 6th order below 1e-3 rad, exact above.
  const double angle = std::sqrt(squared);
  const double scale = angle < 1e-3 ? 0.5 - squared / 48.0 : std::sin(0.5 * angle) / angle;
  const double w = angle < 1e-3 ? 1.0 - squared / 8.0 : std::cos(0.5 * angle);
  const Eigen::Vector3d v = scale * rotation_vector;
  return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized();
}

inline Eigen::Matrix3d ExpSo3(const Eigen::Vector3d& rotation_vector) {
  return ExpQuaternion(rotation_vector).toRotationMatrix();
}

/// Inverse of ExpQuaternion; the result's norm is in [0, pi].
inline Eigen::Vector3d LogQuaternion(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = v.norm();
  if (sine < 1e-9) return 2.0 * v;
  return 2.0 * std::atan2(sine, sign * rotation.w()) / sine * v;
}

/// Right Jacobian of SO(3), slam-spec section 1:
/// Exp(f + d) = Exp(f) Exp(Jr(f) d) to first order in d.
inline Eigen::Matrix3d RightJacobianSo3(const Eigen::Vector3d& f) {
  const double squared = f.squaredNorm();
  const double angle = std::sqrt(squared);
  const Eigen::Matrix3d skew = Skew(f);
  const bool small = angle < 1e-2;
  const double a =
      small ? 0.5 - squared / 24.0 + squared * squared / 720.0 : (1.0 - std::cos(angle)) / squared;
  const double b = small ? 1.0 / 6.0 - squared / 120.0 + squared * squared / 5040.0
                         : (angle - std::sin(angle)) / (squared * angle);
  return Eigen::Matrix3d::Identity() - a * skew + b * skew * skew;
}

/// Left Jacobian: Jl(f) = Jr(-f).
inline Eigen::Matrix3d LeftJacobianSo3(const Eigen::Vector3d& f) { return RightJacobianSo3(-f); }

}  // namespace saccade
