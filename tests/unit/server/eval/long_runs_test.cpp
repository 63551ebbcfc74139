// T14, T16, T41 and T45 in small; `saccade-eval sim --scenario forms|soak` is the whole of them.
#include <gtest/gtest.h>

#include "server/eval/points_tracker.hpp"
#include "server/eval/soak_scenario.hpp"
#include "server/eval/xyz_filter.hpp"

namespace saccade::long_runs_test {
namespace {

/// Mean position NEES over a run; 3 is ideal.
template <typename Step>
double PositionNees(std::size_t frames, const Step& step_of) {
  double sum = 0.0;
  for (std::size_t i = 0; i < frames; ++i) {
    const absl::StatusOr<PointsStep> step = step_of(i);
    EXPECT_TRUE(step.ok()) << step.status();
    if (!step.ok()) return 1e9;
    sum += step->position_nees;
  }
  return sum / static_cast<double>(frames);
}

double PositionNees(XyzFilter& filter, std::size_t frames) {
  return PositionNees(frames, [&](std::size_t i) { return filter.Step(i); });
}

double PositionNees(const PointsWorld& world, const PointsOptions& options, bool range_only) {
  PointsSetup setup = MakeConsistencySetup(options);
  setup.tracker.range_only = range_only;
  auto tracker = PointsTracker::Create(world, options, setup, world.frames.front());
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  if (!tracker.ok()) return 1e9;
  return PositionNees(world.frames.size(),
                      [&](std::size_t i) { return tracker->Step(world.frames[i]); });
}

TEST(Forms, BearingAndRangeIsAsConsistentAsPointsT14) {
  double xyz = 0.0, sid = 0.0, esid = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PointsOptions options;
    options.seed = seed;
    options.duration_s = 15;
    const PointsWorld world = MakePointsWorld(options);
    XyzFilter reference(world, options);
    xyz += PositionNees(reference, world.frames.size());
    sid += PositionNees(world, options, /*range_only=*/false);
    esid += PositionNees(world, options, /*range_only=*/true);
  }
  std::printf("T14: position NEES xyz %.2f, SID %.2f, ESID %.2f (3 is ideal)\n", xyz / 5, sid / 5,
              esid / 5);
  EXPECT_LT(sid, 1.2 * xyz);
  EXPECT_LT(esid, 2.0 * xyz);
}

TEST(Forms, TheReferenceIsConsistentWhereDepthsAreNotInPlay) {
  // Nothing but the target's six points: an ordinary localisation.
  PointsOptions options;
  options.duration_s = 5;
  options.points = options.target_points = 60;
  const PointsWorld world = MakePointsWorld(options);
  XyzFilter reference(world, options);
  const double nees = PositionNees(reference, world.frames.size());
  EXPECT_GT(nees, 2.0);
  EXPECT_LT(nees, 4.2);
}

TEST(Soak, LocalisesAsWellLaterT41T45) {
  PointsOptions options;
  options.duration_s = 60;
  const auto result = RunSoak(options, MakePointsSetup(options));
  ASSERT_TRUE(result.ok()) << result.status();
  std::printf("T41: RMSE %.2f mm from 10 to 20 s, %.2f mm from 50 to 60 s; %zu features\n",
              1e3 * result->early_rmse_m, 1e3 * result->late_rmse_m, result->most_features);
  EXPECT_GT(result->early_rmse_m, 0.0);
  EXPECT_LE(result->late_rmse_m, 1.5 * result->early_rmse_m);
  EXPECT_LE(result->late_rmse_m, 0.02);
  EXPECT_EQ(result->lost_at_s, -1);
  EXPECT_LE(result->most_features, 115U);
  EXPECT_GE(result->least_eigenvalue_over_trace, -1e-12);
  EXPECT_LT(result->memory_late_mb - result->memory_early_mb, 10.0);
}

TEST(Soak, WhatMovesLeavesTheMapT16) {
  PointsOptions options;
  options.duration_s = 40;
  options.moving_points = 10;
  const auto result = RunSoak(options, MakePointsSetup(options));
  ASSERT_TRUE(result.ok()) << result.status();
  std::printf("T16: %d features on what moves, %d of them kept over 2 s (longest %.2f s)\n",
              result->moving_features, result->slow_features, result->slowest_s);
  EXPECT_LE(result->most_features, 115U);
  EXPECT_GE(result->moving_features, 10);
  EXPECT_LE(result->slow_features, result->moving_features / 50);
}

// In these starts the first features, whose depths are guesses, agree with each other on a wrong
// pose and outvote the six points of the target, unless these keep a say. Without adjustment: with
// it two of them stay wrong (docs/measurements/2026-11-29-points.md).
TEST(Soak, StartsHoldWhereTheTargetIsNotOutvoted) {
  for (const std::uint64_t seed : {3, 6, 10}) {
    PointsOptions options;
    options.seed = seed;
    options.duration_s = 20;
    PointsSetup setup = MakePointsSetup(options);
    setup.tracker.adjust = false;
    const auto result = RunSoak(options, setup);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->lost_at_s, -1) << "seed " << seed;
    EXPECT_LT(result->early_rmse_m, 0.01) << "seed " << seed;
  }
}

TEST(Soak, SameSeedSameResult) {
  PointsOptions options;
  options.duration_s = 21;
  const auto a = RunSoak(options, MakePointsSetup(options)),
             b = RunSoak(options, MakePointsSetup(options));
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->late_rmse_m, b->late_rmse_m);
}

TEST(PointsWalk, IsTheWorldFrameByFrame) {
  PointsOptions options;
  options.duration_s = 2;
  options.moving_points = 5;
  options.moving_from_s = 1.0;
  const PointsWorld world = MakePointsWorld(options);
  PointsWalk walk(options);
  for (const PointsFrame& frame : world.frames) {
    const PointsFrame& next = walk.Next();
    ASSERT_EQ(next.world_from_camera.translation, frame.world_from_camera.translation);
    ASSERT_EQ(next.observations.size(), frame.observations.size());
  }
  const int last = options.points - 1;
  EXPECT_EQ(PointAt(world, options, last, 0.9), world.points[last]);
  EXPECT_GT((PointAt(world, options, last, 1.5) - world.points[last]).norm(), 0.2);
  EXPECT_EQ(PointAt(world, options, last - 5, 1.5), world.points[last - 5]);
}

}  // namespace
}  // namespace saccade::long_runs_test
