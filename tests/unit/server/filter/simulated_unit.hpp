#pragma once

#include <array>
#include <cmath>

#include "server/filter/inertial_start.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade {

/// A camera that is carried about by hand, by formula, and what a unit fixed to it feels.
class SimulatedUnit {
 public:
  explicit SimulatedUnit(std::uint64_t seed) : world_(seed) {
    info_.camera_from_imu = {ExpQuaternion({0.3, -1.2, 0.5}), {0.05, -0.03, 0.02}};
    info_.noise = {4e-4, 4e-3, 1e-6, 1e-5};
    for (Wave& wave : waves_) {
      wave.swing = world_.NormalVector<3>(0.12);
      wave.turn = world_.NormalVector<3>(0.15);
      wave.rate = world_.Uniform(2.0, 7.0);
      wave.phase = world_.Uniform(0.0, 6.0);
    }
    gyro_bias_ = world_.NormalVector<3>(0.02);
    accelerometer_bias_ = world_.NormalVector<3>(0.05);
  }

  RandomWorld& world() { return world_; }
  const ImuInfo& info() const { return info_; }
  const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }
  const Eigen::Vector3d& accelerometer_bias() const { return accelerometer_bias_; }
  static Eigen::Vector3d Gravity() { return {0.4, 9.79, -0.1}; }

  Rigid3 WorldFromCamera(double t) const {
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), turned = Eigen::Vector3d::Zero();
    for (const Wave& wave : waves_) {
      place += wave.swing * std::sin(wave.rate * t + wave.phase);
      turned += wave.turn * std::cos(wave.rate * t + 2.0 * wave.phase);
    }
    return {ExpQuaternion(turned), place};
  }
  Eigen::Vector3d UnitVelocity(double t) const {
    constexpr double kStep = 1e-5;
    return (At(t + kStep).translation - At(t - kStep).translation) / (2.0 * kStep);
  }
  /// Samples of [0, seconds] at 200 Hz, with noise and biases; stamped `offset_s` late.
  ImuTrack Samples(double seconds, double offset_s) {
    constexpr double kRate_hz = 200.0, kStep = 1e-4;
    ImuTrack track;
    for (int k = -20; k < static_cast<int>((seconds + 0.1) * kRate_hz); ++k) {
      const double t = k / kRate_hz;
      const Rigid3 now = At(t), before = At(t - kStep), after = At(t + kStep);
      ImuSample sample;
      sample.time_ns = ToNs(t + offset_s);
      sample.angular_velocity_rad_s =
          LogQuaternion(before.rotation.conjugate() * after.rotation) / (2.0 * kStep) + gyro_bias_ +
          world_.NormalVector<3>(info_.noise.gyro_rad_s_rt_hz * std::sqrt(kRate_hz));
      const Eigen::Vector3d acceleration =
          (after.translation - 2.0 * now.translation + before.translation) / (kStep * kStep);
      sample.acceleration_m_s2 =
          now.rotation.conjugate() * (acceleration - Gravity()) + accelerometer_bias_ +
          world_.NormalVector<3>(info_.noise.accelerometer_m_s2_rt_hz * std::sqrt(kRate_hz));
      track.push_back(sample);
    }
    return track;
  }
  static Timestamp ToNs(double t) {
    return 5'000'000'000 + static_cast<Timestamp>(std::llround(1e9 * t));
  }

 private:
  struct Wave {
    Eigen::Vector3d swing, turn;
    double rate = 0.0, phase = 0.0;
  };
  Rigid3 At(double t) const { return WorldFromCamera(t) * info_.camera_from_imu; }

  RandomWorld world_;
  ImuInfo info_;
  std::array<Wave, 3> waves_;
  Eigen::Vector3d gyro_bias_, accelerometer_bias_;
};

}  // namespace saccade
