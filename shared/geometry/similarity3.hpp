#pragma once

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A similarity `target_from_source`: p_target = scale * rotation * p_source + translation; how one
/// map lies in another where lengths differ.
struct Similarity3 {
  double scale = 1.0;  // above 0
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  static Similarity3 FromRigid(const Rigid3& rigid, double scale = 1.0) {
    return {scale, rigid.rotation, rigid.translation};
  }
  Similarity3 Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {1.0 / scale, inverse, -(inverse * translation) / scale};
  }
  /// Where a camera (or anything rigid) of the source is in the target.
  Rigid3 Move(const Rigid3& source_from_camera) const {
    return {(rotation * source_from_camera.rotation).normalized(),
            scale * (rotation * source_from_camera.translation) + translation};
  }
};

inline Similarity3 operator*(const Similarity3& a_from_b, const Similarity3& b_from_c) {
  return {a_from_b.scale * b_from_c.scale, (a_from_b.rotation * b_from_c.rotation).normalized(),
          a_from_b.scale * (a_from_b.rotation * b_from_c.translation) + a_from_b.translation};
}

inline Eigen::Vector3d operator*(const Similarity3& a_from_b, const Eigen::Vector3d& point_in_b) {
  return a_from_b.scale * (a_from_b.rotation * point_in_b) + a_from_b.translation;
}

}  // namespace saccade
