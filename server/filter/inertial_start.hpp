#pragma once

#include <optional>
#include <span>

#include "server/filter/inertial_motion.hpp"

namespace saccade {

/// A pose that pictures alone have found, in a world of unknown unit.
struct SeenPose {
  Timestamp time_ns = 0;
  Rigid3 world_from_camera;
  double position_sigma = 1e-3;  // of the world's unit
  double rotation_sigma_rad = 1e-3;
};

/// What an inertial unit adds to poses from pictures (docs/derivations/inertial.md).
struct InertialSolution {
  double metres_per_unit = 1.0;
  double scale_sigma = 1.0;  // relative
  /// At the newest pose, in the world as it was before, but in metres; imu is filled in.
  CameraMotion motion;
  /// Of [ln scale | errors as InertialErrors]; position and rotation are the pictures' and zero.
  Eigen::Matrix<double, 1 + InertialErrors::kDim, 1 + InertialErrors::kDim> covariance;
  double misfit = 0.0;  // chi-squared by its degrees of freedom; 1: as good as the sigmas say
};

/// The same in a world that is turned.
void TurnWorld(const Eigen::Quaterniond& turn, InertialSolution& solution);

struct InertialStartOptions {
  double gyro_bias_sigma_rad_s = 0.1;
  double accelerometer_bias_sigma_m_s2 = 0.2;
  double gravity_m_s2 = 9.81;
  double gravity_sigma_m_s2 = 0.02;  // from the poles to the equator
  int iterations = 8;
};

/// Solves poses and samples of a few seconds as one problem: unit of length, gravity, biases, clock
/// offset and all velocities; the poses may move within their sigmas. At least four poses, in order
/// of time, which the samples must cover. Nothing: they do not, or the problem has no solution (as
/// of a camera without acceleration). O(n^3) for n poses; 20 take some ms.
std::optional<InertialSolution> SolveInertialStart(std::span<const SeenPose> poses,
                                                   std::span<const ImuSample> samples,
                                                   const ImuInfo& unit,
                                                   const InertialStartOptions& options);

}  // namespace saccade
