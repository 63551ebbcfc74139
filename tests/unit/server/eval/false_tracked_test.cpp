#include "server/eval/false_tracked.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/eval/scale_windows.hpp"

namespace saccade::false_tracked_test {
namespace {

using Eigen::Vector3d;

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();
const Rigid3 kMoved = {ExpQuaternion({0.7, -1.2, 2.0}), {5, -3, 8}};

/// A walk of `seconds` at 30 Hz, about 0.5 m/s, seen perfectly but from another origin and with
/// lengths `scale` times the true ones.
std::vector<PosePair> Walk(double seconds, double scale = 1.0) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < static_cast<int>(30 * seconds); ++i) {
    const double t = i / 30.0;
    const Rigid3 truth = {ExpQuaternion({0.1 * std::sin(t), 0.2 * t, 0}),
                          {0.5 * t, 0.3 * std::sin(1.1 * t), 0.4 * std::cos(0.7 * t)}};
    Rigid3 estimate = truth;
    estimate.translation *= scale;
    pairs.push_back({static_cast<Timestamp>(i) * 33'333'333, kMoved * estimate, truth});
  }
  return pairs;
}

/// The estimate of pairs [begin, end) moved by `offset` metres.
void Shift(std::vector<PosePair>& pairs, std::size_t begin, std::size_t end, Vector3d offset) {
  for (std::size_t i = begin; i < end; ++i) pairs[i].estimate.translation += offset;
}

/// Scales the estimate of the first `count` about pose `count`, so that the path stays whole.
void ScaleStart(std::vector<PosePair>& pairs, std::size_t count, double scale) {
  const Vector3d joint = pairs[count].estimate.translation;
  for (std::size_t i = 0; i < count; ++i) {
    Vector3d& place = pairs[i].estimate.translation;
    place = joint + scale * (place - joint);
  }
}

TEST(FalseTracked, ARightPathHasNone) {
  EXPECT_EQ(CountFalseTracked(Walk(30), TrajectoryAlignment::kSe3).frames, 0);
  EXPECT_EQ(CountFalseTracked(Walk(30, 0.3), TrajectoryAlignment::kSim3).frames, 0);
  EXPECT_LT(CountFalseTracked(Walk(30, 0.3), TrajectoryAlignment::kSim3).worst_m, 1e-6);
  EXPECT_EQ(CountFalseTracked({}, TrajectoryAlignment::kSim3).frames, 0);
}

TEST(FalseTracked, NoiseOfTwoCentimetresIsNoFalseClaimNotEvenAtTheStart) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::vector<PosePair> pairs = Walk(30);
    std::mt19937 rng(seed);
    std::normal_distribution<double> noise(0, 0.02);
    for (PosePair& pair : pairs) {
      pair.estimate.translation += Vector3d(noise(rng), noise(rng), noise(rng));
    }
    EXPECT_EQ(CountFalseTracked(pairs, TrajectoryAlignment::kSim3).frames, 0) << "seed " << seed;
    EXPECT_EQ(CountFalseTracked(pairs, TrajectoryAlignment::kSe3).frames, 0) << "seed " << seed;
  }
}

TEST(FalseTracked, AWrongScaleOfAMetricMapCountsAndIsFreeWhereNoScaleIsClaimed) {
  EXPECT_GT(CountFalseTracked(Walk(30, 0.8), TrajectoryAlignment::kSe3).frames, 300);
  EXPECT_EQ(CountFalseTracked(Walk(30, 0.8), TrajectoryAlignment::kSim3).frames, 0);
}

TEST(FalseTracked, AStartAtTheWrongScaleCountsButNotWhatFollows) {
  std::vector<PosePair> pairs = Walk(30);
  ScaleStart(pairs, 90, 0.4);  // 1.5 m of path in the first 3 s
  const FalseTracked wrong = CountFalseTracked(pairs, TrajectoryAlignment::kSim3);
  // Those nearer to the joint than 25 cm are less than 15 cm off.
  EXPECT_GT(wrong.against_whole, 60);
  EXPECT_LT(wrong.against_whole, 90);
  EXPECT_EQ(wrong.frames, wrong.against_whole);
  EXPECT_EQ(wrong.first_time_ns, 0);
}

TEST(FalseTracked, AJumpAfterAGapCountsForAsLongAsItLasts) {
  std::vector<PosePair> pairs = Walk(30);
  Shift(pairs, 300, 304, {0.5, 0.2, 0});
  const FalseTracked wrong = CountFalseTracked(pairs, TrajectoryAlignment::kSim3);
  EXPECT_EQ(wrong.frames, 4);
  EXPECT_EQ(wrong.against_before, 4);
  EXPECT_EQ(wrong.first_time_ns, pairs[300].time_ns);
  EXPECT_NEAR(wrong.worst_m, std::hypot(0.5, 0.2), 0.02);
}

TEST(FalseTracked, OfARunTornByAJumpTheSmallerPartCounts) {
  std::vector<PosePair> late = Walk(30), early = late;
  Shift(late, 600, 900, {0.3, 0.3, 0});  // 42 cm: a plain alignment would split it
  const auto torn = [](const std::vector<PosePair>& pairs) {
    return CountFalseTracked(pairs, TrajectoryAlignment::kSe3).frames;
  };
  EXPECT_GT(torn(late), 200);  // of 300
  EXPECT_LE(torn(late), 310);
  Shift(early, 0, 300, {0.3, 0.3, 0});
  EXPECT_GT(torn(early), 200);
  EXPECT_LE(torn(early), 310);
}

TEST(FalseTracked, WhatLeavesThePathBeforeCountsThoughTheWholeForgivesIt) {
  // Half a minute on a circle of 0.8 m, then 6 m away at 0.87 of the scale, and there for a minute:
  // when the wearer left, the marks round the circle went wrong by more than 15 cm.
  std::vector<PosePair> pairs;
  for (int i = 0; i < 3000; ++i) {
    const double t = i / 30.0, out = std::clamp(0.5 * (t - 30), 0.0, 6.0);
    const Vector3d truth(0.8 * std::cos(t) + out, 0.8 * std::sin(t), 0.2 * std::sin(0.3 * t));
    const Vector3d estimate = truth - Vector3d(0.13 * out, 0, 0);
    pairs.push_back({i * Timestamp{33'333'333}, {kLevel, estimate}, {kLevel, truth}});
  }
  const FalseTracked wrong = CountFalseTracked(pairs, TrajectoryAlignment::kSim3);
  EXPECT_GT(wrong.against_before, 30);
  EXPECT_GT(wrong.frames, wrong.against_whole + 30);  // these the whole alone would forgive
}

TEST(RunningAlignment, IsTheAlignmentOfAllItsPoints) {
  const std::vector<PosePair> pairs = Walk(4, 0.5);
  RunningAlignment running(TrajectoryAlignment::kSim3);
  for (const PosePair& pair : pairs) {
    running.Add(pair.estimate.translation, pair.truth.translation);
  }
  EXPECT_NEAR(running.Align().scale, 2.0, 1e-9);
  EXPECT_LT((running.Align() * pairs[50].estimate.translation - pairs[50].truth.translation).norm(),
            1e-9);
}

TEST(RunningAlignment, AStraightPathCarriesAlongItsLineOnly) {
  RunningAlignment running(TrajectoryAlignment::kSim3);
  for (int i = 0; i <= 20; ++i) running.Add({0.1 * i, 0, 0}, {0.1 * i, 0, 0});
  EXPECT_NEAR(running.Leverage({1, 0, 0}), 1.0, 1e-6);  // its middle
  EXPECT_LT(running.Leverage({2.5, 0, 0}), 3.0);
  EXPECT_GT(running.Leverage({4, 0, 0}), 3.0);
  EXPECT_GT(running.Leverage({1, 0.5, 0}), 100.0);  // turned about the line: anywhere
}

TEST(ScaleWindows, AreOneWhereScaleHolds) {
  const auto windows = ScaleOfWindows(Walk(20, 0.3));
  ASSERT_TRUE(windows);
  EXPECT_NEAR(windows->min, 1.0, 1e-9);
  EXPECT_NEAR(windows->max, 1.0, 1e-9);
  EXPECT_EQ(windows->windows, 509);  // one begins at each pose up to 3 s before the end
}

TEST(ScaleWindows, AStartThatIsTooSmallShows) {
  std::vector<PosePair> pairs = Walk(30);
  ScaleStart(pairs, 120, 0.5);
  const auto windows = ScaleOfWindows(pairs);
  ASSERT_TRUE(windows);
  EXPECT_NEAR(windows->max, 2.0, 0.15);  // truth is twice the estimate there
  EXPECT_GT(windows->min, 0.9);
}

TEST(ScaleWindows, StandingStillHoldsNoScale) {
  std::vector<PosePair> pairs = Walk(10);
  for (PosePair& pair : pairs) pair.truth.translation *= 0.01;
  EXPECT_FALSE(ScaleOfWindows(pairs));
  EXPECT_FALSE(ScaleOfWindows(Walk(2)));  // no window fits
}

}  // namespace
}  // namespace saccade::false_tracked_test
