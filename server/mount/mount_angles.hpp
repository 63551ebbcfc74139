#pragma once

#include <Eigen/Core>

namespace saccade {

/// Joint angles of a mount [rad]; of a Frame: at mid-exposure, by the encoders.
struct MountAngles {
  double pan_rad = 0, elevation_rad = 0, cyclotorsion_rad = 0;
};

/// The joints in the order in which vectors hold them, whatever their order along the mount.
enum class MountJoint { kPan, kElevation, kCyclotorsion };
inline constexpr int kMountJoints = 3;

inline Eigen::Vector3d ToVector(const MountAngles& angles) {
  return {angles.pan_rad, angles.elevation_rad, angles.cyclotorsion_rad};
}
inline MountAngles ToAngles(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

}  // namespace saccade
