#pragma once

#include <span>

#include "server/capture/imu.hpp"
#include "server/filter/motion_model.hpp"

namespace saccade {

/// Samples of an inertial unit, and between which pictures they are to carry a camera.
struct ImuStep {
  std::span<const ImuSample> samples;
  Timestamp from_ns = 0, to_ns = 0;  // by the pictures' time stamps
  ImuNoise noise;
};

/// What the inertial model has in the state: offsets of its errors, 3 each but for the last.
struct InertialErrors {
  static constexpr int kPosition = 0, kRotation = 3;  // of the camera
  static constexpr int kVelocity = 6;                 // of the unit [m/s, world]
  static constexpr int kGyroBias = 9, kAccelerometerBias = 12;
  static constexpr int kGravity = 15;  // [m/s^2, world]
  static constexpr int kOffset = 18;   // of the unit's clock [s]
  static constexpr int kDim = 19;
};

/// A camera whose motion an inertial unit measures (docs/derivations/inertial.md): biases, gravity
/// in world and the clock offset are part of the state. Steps without samples are those of M1, with
/// the turn rate last measured.
const MotionModel& InertialMotion();

/// Whether samples reach from picture to picture, `offset_s` and all, without a hole that lets the
/// motion be guessed only.
bool Covers(const ImuStep& step, double offset_s);

/// The camera carried on by samples, which must cover the step. Its errors as InertialErrors.
MotionModel::Step PropagateInertial(const CameraMotion& motion, const ImuStep& step);

}  // namespace saccade
