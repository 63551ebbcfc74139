#include "server/tracker/present_motion.hpp"

#include <gtest/gtest.h>

namespace saccade::present_motion_test {
namespace {

constexpr double kSway_s = 1.2;  // a hand's

/// A hand that sways and turns.
CameraMotion Truth(double t) {
  const double w = 2.0 * M_PI / kSway_s;
  CameraMotion motion;
  motion.world_from_camera = {ExpQuaternion({0.0, 0.2 * std::sin(w * t), 0.0}),
                              {0.1 * std::sin(w * t), 0.0, 0.0}};
  motion.velocity_m_s = {0.1 * w * std::cos(w * t), 0.0, 0.0};
  motion.angular_velocity_rad_s = {0.0, 0.2 * w * std::cos(w * t), 0.0};
  return motion;
}

/// Root mean square error of velocity and angular velocity: as predicted, and of now.
struct Errors {
  Eigen::Vector2d predicted = Eigen::Vector2d::Zero(), present = Eigen::Vector2d::Zero();
};

Errors Measure(double dt) {
  Errors errors;
  int count = 0;
  for (double t = 0.3; t < 3.0; t += 0.01, ++count) {
    // What a filter holds: where the camera was, and the mean velocities of the step to there.
    const CameraMotion first = Truth(t - 2.0 * dt), second = Truth(t - dt), now = Truth(t);
    CameraMotion held = second;
    held.velocity_m_s =
        (second.world_from_camera.translation - first.world_from_camera.translation) / dt;
    held.angular_velocity_rad_s = LogQuaternion(first.world_from_camera.rotation.conjugate() *
                                                second.world_from_camera.rotation) /
                                  dt;
    FilterState filter{FilterOptions()};
    filter.Reset(held, 1e-6 * Matrix12d::Identity());
    const MotionStep step{dt, MotionNoise()};
    filter.Predict(dt, step.noise);
    const auto add = [&](const CameraMotion& motion, Eigen::Vector2d& sum) {
      sum += Eigen::Vector2d(
          (motion.velocity_m_s - now.velocity_m_s).squaredNorm(),
          (motion.angular_velocity_rad_s - now.angular_velocity_rad_s).squaredNorm());
    };
    add(filter.WholeMotion(), errors.predicted);
    add(PresentMotion(filter, now.world_from_camera, step), errors.present);
  }
  errors.predicted = (errors.predicted / count).cwiseSqrt();
  errors.present = (errors.present / count).cwiseSqrt();
  return errors;
}

TEST(PresentMotion, IsNotOneAndAHalfStepsOld) {
  for (const double dt : {1.0 / 30.0, 1.0 / 15.0}) {
    const Errors errors = Measure(dt);
    std::printf("%2.0f pictures a second: velocity %.3f -> %.3f m/s, turn %.3f -> %.3f rad/s\n",
                1.0 / dt, errors.predicted[0], errors.present[0], errors.predicted[1],
                errors.present[1]);
    EXPECT_LT(errors.present[0], 0.25 * errors.predicted[0]);
    EXPECT_LT(errors.present[1], 0.25 * errors.predicted[1]);
  }
}

TEST(PresentMotion, WhatWasNotKnownBeforeIsNoAcceleration) {
  constexpr double kStep_s = 1.0 / 15.0;
  Matrix12d covariance = Matrix12d::Zero();
  covariance.diagonal().tail<6>().setConstant(100.0);  // nothing is known of the velocities
  FilterState filter{FilterOptions()};
  filter.Reset(CameraMotion(), covariance);
  filter.Predict(kStep_s, MotionNoise());
  const Rigid3 pose{Eigen::Quaterniond::Identity(), {0.02, 0.0, 0.0}};
  const CameraMotion motion = PresentMotion(filter, pose, {kStep_s, MotionNoise()});
  EXPECT_NEAR(motion.velocity_m_s.x(), 0.02 / kStep_s, 0.01);
}

TEST(PresentMotion, WithoutAStepItIsWhatTheFilterHolds) {
  CameraMotion held;
  held.velocity_m_s = {0.1, 0.2, 0.3};
  FilterState filter{FilterOptions()};
  filter.Reset(held, 1e-4 * Matrix12d::Identity());
  const Rigid3 pose{Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}};
  EXPECT_EQ(PresentMotion(filter, pose, MotionStep()).velocity_m_s, held.velocity_m_s);
}

}  // namespace
}  // namespace saccade::present_motion_test
