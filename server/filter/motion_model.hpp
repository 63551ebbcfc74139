#pragma once

#include <Eigen/Dense>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// What the filter knows of the moving camera: 13 numbers, 12 error dimensions in the order
/// [position (world), rotation (local, on the right), velocity (world), angular velocity (camera)].
struct CameraMotion {
  Rigid3 world_from_camera;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();            // in world
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  // in camera
};

/// `camera` [+] `error`, and its inverse `to` [-] `from` (slam-spec section 1).
CameraMotion Plus(const CameraMotion& camera, const Vector12d& error);
Vector12d Minus(const CameraMotion& to, const CameraMotion& from);

/// Impulses that M1 allows itself within one step: standard deviations of the accelerations.
struct MotionNoise {
  double acceleration_m_s2 = 4.0;            // handheld [SL2]
  double angular_acceleration_rad_s2 = 6.0;  // handheld [SL2]
};

struct MotionJacobians {
  Matrix12d f = Matrix12d::Identity();  // d next error / d error
  Matrix12d q = Matrix12d::Zero();      // covariance that the step adds
};

/// M1, `agile` (slam-spec 3): constant velocity and constant angular velocity for `dt` seconds.
/// `impulse` [V; Omega] is the random change of the velocities, zero for the mean.
CameraMotion PropagateMotion(
    const CameraMotion& camera, double dt,
    const Eigen::Matrix<double, 6, 1>& impulse = Eigen::Matrix<double, 6, 1>::Zero());

/// Jacobians of the same step. With first-estimates Jacobians `first_rotation` is the rotation that
/// the errors were last linearised at; otherwise camera.world_from_camera.rotation.
MotionJacobians LineariseMotion(const CameraMotion& camera,
                                const Eigen::Quaterniond& first_rotation, double dt,
                                const MotionNoise& noise);

/// What a mount's joints did to the camera in one step, by its encoders; the wearer's motion comes
/// on top.
struct HeadMotion {
  /// Where the optic centre would have gone had the wearer stood still.
  Rigid3 camera_from_next;
  /// Of its errors [position, in the camera before; rotation, local in the camera after].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// The camera after its joints have moved. The velocities, which are those of a camera whose joints
/// stand still, go along: the same motion of the wearer, seen at the new place.
CameraMotion TurnHead(const CameraMotion& camera, const Rigid3& camera_from_next);
/// Its Jacobians; `q` is what the encoders' errors add.
MotionJacobians LineariseHead(const CameraMotion& camera, const HeadMotion& head);

}  // namespace saccade
