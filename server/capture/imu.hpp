#pragma once

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// What an inertial measurement unit says at one moment of the capture clock, in its own axes.
struct ImuSample {
  Timestamp time_ns = 0;
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();  // specific force: with gravity
};

/// In order of time. Those around a frame, from before the frame before it on; shared, immutable.
using ImuTrack = std::vector<ImuSample>;

/// Of white noise, per root of bandwidth, and of the random walks of the biases. Defaults: twice
/// what makers give for small units, as they shake on what they are fixed to.
struct ImuNoise {
  double gyro_rad_s_rt_hz = 4e-4;
  double accelerometer_m_s2_rt_hz = 4e-3;
  double gyro_walk_rad_s2_rt_hz = 4e-5;
  double accelerometer_walk_m_s3_rt_hz = 2e-3;
};

/// A unit that is fixed to a camera.
struct ImuInfo {
  Rigid3 camera_from_imu;
  ImuNoise noise;
  double offset_sigma_s = 0.01;  // of its clock against the pictures' time stamps
};

}  // namespace saccade
