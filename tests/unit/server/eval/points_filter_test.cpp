#include "server/eval/points_filter.hpp"

#include <gtest/gtest.h>

namespace saccade {
namespace {

struct Means {
  double nees = 0, nis_per_match = 0, worst_m = 0;
};

/// Over `runs` runs of `seconds` each.
Means RunAll(PointsMode mode, int runs, double seconds) {
  Means means;
  int steps = 0, matches = 0;
  for (int run = 1; run <= runs; ++run) {
    PointsOptions options;
    options.seed = static_cast<std::uint64_t>(run);
    options.duration_s = seconds;
    const PointsWorld world = MakePointsWorld(options);
    PointsFilter filter(world, options, mode);
    for (std::size_t i = 0; i < world.frames.size(); ++i) {
      const auto step = filter.Step(i);
      EXPECT_TRUE(step.ok()) << step.status();
      if (!step.ok()) return means;
      means.nees += step->nees;
      means.nis_per_match += step->nis;
      means.worst_m = std::max(means.worst_m, step->position_error_m);
      matches += step->matches;
      ++steps;
    }
  }
  means.nees /= steps;
  means.nis_per_match /= matches;
  return means;
}

// T39, in small: `saccade-eval sim --scenario points --runs 50` is the whole of it.
TEST(PointsFilter, KnownMapIsConsistent) {
  const Means means = RunAll(PointsMode::kKnownMap, 6, 10);
  EXPECT_GT(means.nees, 5.3);
  EXPECT_LT(means.nees, 6.7);
  EXPECT_NEAR(means.nis_per_match, 2.0, 0.05);
  EXPECT_LT(means.worst_m, 0.03);
}

// T40, in small.
TEST(PointsFilter, FullSlamStaysWithinTwiceTheConsistentError) {
  const Means means = RunAll(PointsMode::kSlamFej, 6, 10);
  EXPECT_LT(means.nees, 12.0);
  EXPECT_LT(means.worst_m, 0.10);
}

}  // namespace
}  // namespace saccade
