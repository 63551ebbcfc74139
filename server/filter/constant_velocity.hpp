#pragma once

#include "server/filter/motion_model.hpp"

namespace saccade {

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

/// The model that uses them: 12 errors, all of CameraMotion's.
const MotionModel& ConstantVelocity();

}  // namespace saccade
