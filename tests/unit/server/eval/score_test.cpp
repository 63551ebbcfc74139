#include "server/eval/score.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace saccade::score_test {
namespace {

using Eigen::Vector3d;

/// A camera on a bent path, at 30 Hz for `seconds`.
Trajectory BentPath(double seconds) {
  Trajectory path;
  for (int i = 0; i < static_cast<int>(30 * seconds); ++i) {
    const double t = i / 30.0;
    path.push_back({static_cast<Timestamp>(i) * 33'333'333,
                    {ExpQuaternion({0.2 * std::sin(t), 0.3 * t, 0.1}),
                     {std::sin(t), 0.5 * std::cos(1.3 * t), 0.2 * t}}});
  }
  return path;
}

Trajectory Transformed(Trajectory path, const Rigid3& a_from_b, double scale) {
  for (StampedPose& pose : path) {
    pose.world_from_camera.translation *= scale;
    pose.world_from_camera = a_from_b * pose.world_from_camera;
  }
  return path;
}

const Rigid3 kMoved = {ExpQuaternion({0.7, -1.2, 2.0}), {5, -3, 8}};

TEST(Score, RigidlyMovedCopyIsPerfect) {
  const Trajectory truth = BentPath(10);
  const auto score =
      Score(Associate(Transformed(truth, kMoved, 1.0), truth), TrajectoryAlignment::kSe3);
  ASSERT_TRUE(score.ok());
  EXPECT_EQ(score->pairs, truth.size());
  EXPECT_LT(score->ate_se3_m, 1e-12);
  EXPECT_LT(score->rotation_se3_deg, 1e-6);
  EXPECT_NEAR(score->scale, 1.0, 1e-12);
  EXPECT_LT(*score->rpe_1s_m, 1e-12);
}

TEST(Score, WrongScaleIsForgivenBySim3Only) {
  const Trajectory truth = BentPath(10);
  const auto pairs = Associate(Transformed(truth, kMoved, 0.5), truth);
  const auto score = Score(pairs, TrajectoryAlignment::kSim3);
  ASSERT_TRUE(score.ok());
  EXPECT_NEAR(score->scale, 2.0, 1e-9);
  EXPECT_LT(score->ate_sim3_m, 1e-9);
  EXPECT_NEAR(score->ate_se3_m, 0.5 * score->ate_null_m, 1e-9);
  EXPECT_LT(*score->rpe_1s_m, 1e-9);
  EXPECT_GT(*Score(pairs, TrajectoryAlignment::kSe3)->rpe_1s_m, 0.1);
}

TEST(Score, NoiseComesBackAsItsRootMeanSquare) {
  const Trajectory truth = BentPath(60);
  Trajectory shifted = truth, turned = truth;
  std::mt19937 rng(5);
  std::normal_distribution<double> noise(0, 0.01);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    shifted[i].world_from_camera.translation += Vector3d(noise(rng), noise(rng), noise(rng));
    turned[i].world_from_camera.rotation =
        truth[i].world_from_camera.rotation * ExpQuaternion({noise(rng), noise(rng), noise(rng)});
  }
  const double expected = 0.01 * std::sqrt(3.0), degrees = expected * 57.29578;
  const auto position = Score(Associate(shifted, truth), TrajectoryAlignment::kSe3);
  ASSERT_TRUE(position.ok());
  EXPECT_NEAR(position->ate_se3_m, expected, 0.05 * expected);
  EXPECT_NEAR(*position->rpe_1s_m, expected * std::sqrt(2.0), 0.1 * expected);
  const auto rotation = Score(Associate(turned, truth), TrajectoryAlignment::kSe3);
  ASSERT_TRUE(rotation.ok());
  EXPECT_LT(rotation->ate_se3_m, 1e-9);
  EXPECT_NEAR(rotation->rotation_se3_deg, degrees, 0.05 * degrees);
  EXPECT_NEAR(*rotation->rpe_1s_deg, degrees * std::sqrt(2.0), 0.1 * degrees);
}

TEST(Score, StandingStillScoresTheNullError) {
  const Trajectory truth = BentPath(10);
  Trajectory still = truth;
  for (StampedPose& pose : still) pose.world_from_camera = {};
  const auto score = Score(Associate(still, truth), TrajectoryAlignment::kSim3);
  ASSERT_TRUE(score.ok());
  EXPECT_NEAR(score->ate_se3_m, score->ate_null_m, 1e-12);
  EXPECT_NEAR(score->ate_sim3_m, score->ate_null_m, 1e-12);
}

TEST(Score, MirroredPathIsNotTurnedIntoARotation) {
  const Trajectory truth = BentPath(10);
  Trajectory mirrored = truth;
  for (StampedPose& pose : mirrored) pose.world_from_camera.translation.x() *= -1;
  const auto score = Score(Associate(mirrored, truth), TrajectoryAlignment::kSe3);
  ASSERT_TRUE(score.ok());
  EXPECT_GT(score->ate_se3_m, 0.05);
}

TEST(Score, TooFewPairsAreRefused) {
  const Trajectory truth = BentPath(1);
  const Trajectory two(truth.begin(), truth.begin() + 2);
  EXPECT_EQ(Score(Associate(two, truth), TrajectoryAlignment::kSe3).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(Associate, DenseTruthIsInterpolated) {
  Trajectory truth;  // 100 Hz
  for (int i = 0; i < 100; ++i) {
    truth.push_back(
        {i * Timestamp{10'000'000}, {ExpQuaternion({0, 0, 0.001 * i}), {0.1 * i, 0, 0}}});
  }
  Trajectory estimate;  // 25 Hz, off by 3 ms
  for (int i = 0; i < 20; ++i) estimate.push_back({i * Timestamp{40'000'000} + 3'000'000, {}});
  const auto pairs = Associate(estimate, truth);
  ASSERT_EQ(pairs.size(), 20);
  EXPECT_NEAR(pairs[1].truth.translation.x(), 0.43, 1e-12);
  EXPECT_NEAR(LogQuaternion(pairs[1].truth.rotation).z(), 0.0043, 1e-12);
}

TEST(Associate, GapsInTheTruthAreNotBridged) {
  Trajectory truth = {{0, {}}, {1'000'000'000, {}}, {1'040'000'000, {}}};
  Trajectory estimate;
  for (int i = 0; i < 26; ++i) estimate.push_back({i * Timestamp{40'000'000}, {}});
  const auto pairs = Associate(estimate, truth);
  ASSERT_EQ(pairs.size(), 2);  // at 0 and at 1 s
  EXPECT_EQ(pairs[1].time_ns, 1'000'000'000);
}

}  // namespace
}  // namespace saccade::score_test
