#pragma once

#include <Eigen/Dense>

#include "shared/geometry/so3.hpp"

namespace saccade {

/// A rigid transform `target_from_source`: p_target = rotation * p_source + translation.
///
/// Written so that neighbours cancel:
///   point_in_world = world_from_camera * camera_from_anchor * point_in_anchor.
/// Rotation is a unit Hamilton quaternion, translation in metres.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3 Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, -(inverse * translation)};
  }
  Eigen::Matrix3d RotationMatrix() const { return rotation.toRotationMatrix(); }
};

inline Rigid3 operator*(const Rigid3& a_from_b, const Rigid3& b_from_c) {
  return {(a_from_b.rotation * b_from_c.rotation).normalized(),
          a_from_b.rotation * b_from_c.translation + a_from_b.translation};
}

inline Eigen::Vector3d operator*(const Rigid3& a_from_b, const Eigen::Vector3d& point_in_b) {
  return a_from_b.rotation * point_in_b + a_from_b.translation;
}

/// Angle [rad] of the rotation between two transforms, in [0, pi].
inline double RotationAngle(const Rigid3& a, const Rigid3& b) {
  return LogQuaternion(a.rotation.conjugate() * b.rotation).norm();
}

}  // namespace saccade
