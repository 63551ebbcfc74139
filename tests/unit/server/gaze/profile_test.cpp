#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/gaze/axis_profile.hpp"
#include "server/gaze/wearer_predictor.hpp"

namespace saccade::profile_test {
namespace {

TEST(AxisProfile, ReachesAnyGoalWithinItsLimitsWithoutOvershoot) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> goal_of(-2, 2), dt_of(0.004, 0.03);
  for (int trial = 0; trial < 200; ++trial) {
    const AxisLimits limits{
        .rate = 0.5, .acceleration = 5, .gain_per_s = 12, .least = -3, .most = 3};
    AxisProfile axis;
    const double goal = goal_of(rng), dt = dt_of(rng);
    for (double t = 0; t < 6; t += dt) {
      const double before = axis.rate;
      axis.Follow(goal, 0, limits, dt);
      EXPECT_LE(std::abs(axis.rate), limits.rate + 1e-12);
      EXPECT_LE(std::abs(axis.rate - before), limits.acceleration * dt + 1e-12);
      EXPECT_LE(axis.angle * std::copysign(1.0, goal), std::abs(goal) + 2e-3);
    }
    EXPECT_NEAR(axis.angle, goal, 1e-4);
  }
}

TEST(AxisProfile, StopsAtItsLimits) {
  const AxisLimits limits{
      .rate = 1, .acceleration = 10, .gain_per_s = 12, .least = -0.5, .most = 0.5};
  AxisProfile axis;
  for (int k = 0; k < 300; ++k) axis.Follow(2, 1, limits, 0.01);
  EXPECT_NEAR(axis.angle, 0.5, 1e-6);
  EXPECT_NEAR(axis.rate, 0, 1e-3);
}

TEST(AxisProfile, FollowsAMovingGoalWithoutLag) {
  const AxisLimits limits{.rate = 1, .acceleration = 10, .gain_per_s = 12, .least = -3, .most = 3};
  AxisProfile axis;
  double goal = 0;
  for (int k = 0; k < 300; ++k) {
    goal += 0.3 * 0.01;
    axis.Follow(goal, 0.3, limits, 0.01);
  }
  EXPECT_NEAR(axis.angle, goal, 1e-6);
}

TEST(WearerPredictor, CarriesAConstantMotionOnExactly) {
  WearerPredictor predictor(0.25);
  const Eigen::Vector3d velocity(0.3, -0.1, 0.5), turn(0.2, 0.4, -0.1);
  const auto pose_at = [&](double t) { return Rigid3{ExpQuaternion(turn * t), velocity * t}; };
  EXPECT_FALSE(predictor.At(0));
  for (int k = 0; k < 10; ++k) predictor.Add(k * 33'333'333LL, pose_at(k * 0.033333333));
  const auto ahead = predictor.At(9 * 33'333'333LL + 80'000'000);
  ASSERT_TRUE(ahead);
  const Rigid3 truth = pose_at(9 * 0.033333333 + 0.08);
  EXPECT_LT((ahead->translation - truth.translation).norm(), 1e-6);
  EXPECT_LT(RotationAngle(*ahead, truth), 1e-6);
}

TEST(WearerPredictor, GoesOnAfterTheClockWasSetBack) {
  WearerPredictor predictor(0.25);
  for (const Timestamp start_ns : {Timestamp{7'200'000'000'000}, Timestamp{3'600'000'000'000}}) {
    for (int i = 0; i < 10; ++i) {
      Rigid3 pose;
      pose.translation.x() = Seconds(start_ns) + 0.1 * i;
      predictor.Add(start_ns + i * Timestamp{33'333'333}, pose);
    }
    EXPECT_NEAR(predictor.Newest()->translation.x(), Seconds(start_ns) + 0.9, 1e-9);
    EXPECT_EQ(predictor.newest_ns(), start_ns + 9 * Timestamp{33'333'333});
  }
}

TEST(WearerPredictor, FollowsAHalfHertzSwayAheadOfTime) {
  WearerPredictor predictor(0.25);
  const auto angle_at = [](double t) { return 0.105 * std::sin(3.14159 * t); };
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const double t = k / 30.0;
    predictor.Add(std::llround(1e9 * t),
                  {ExpQuaternion({0, angle_at(t), 0}), {0, 0, 0.3 * angle_at(t)}});
    if (k < 10) continue;
    const auto ahead = predictor.At(std::llround(1e9 * (t + 0.08)));
    const Rigid3 truth{ExpQuaternion({0, angle_at(t + 0.08), 0}), {0, 0, 0}};
    worst = std::max(worst, RotationAngle(*ahead, truth));
  }
  EXPECT_LT(worst, 0.004);  // 0.2 deg, where a constant velocity is off by 0.6
}

// A fast saccade: a third of a second without poses, then a few, each wrong by 0.1 deg.
TEST(WearerPredictor, AfterAShortGapTheRateIsStillKnown) {
  WearerPredictor predictor(0.25);
  const auto angle_at = [](double t) { return 0.15 * t; };  // 9 deg/s
  double worst = 0;
  for (int k = 0; k < 60; ++k) {
    if (k >= 40 && k < 50) continue;
    const double t = k / 30.0, noise = k % 2 == 0 ? 0.0017 : -0.0017;
    predictor.Add(std::llround(1e9 * t), {ExpQuaternion({0, angle_at(t) + noise, 0}), {0, 0, 0}});
    if (k < 50 || k > 56) continue;
    const auto ahead = predictor.At(std::llround(1e9 * (t + 0.1)));
    const Rigid3 truth{ExpQuaternion({0, angle_at(t + 0.1), 0}), {0, 0, 0}};
    worst = std::max(worst, RotationAngle(*ahead, truth));
  }
  EXPECT_LT(worst, 0.007);  // 0.4 deg; from the poses since the gap alone 1.0
}

TEST(WearerPredictor, AfterAGapItStartsAnew) {
  WearerPredictor predictor(0.25);
  for (int k = 0; k < 10; ++k) predictor.Add(k * 33'333'333LL, {{1, 0, 0, 0}, {0.1 * k, 0, 0}});
  predictor.Add(5'000'000'000LL, {{1, 0, 0, 0}, {7, 0, 0}});
  EXPECT_EQ(predictor.At(5'200'000'000LL)->translation.x(), 7.0);
}

}  // namespace
}  // namespace saccade::profile_test
