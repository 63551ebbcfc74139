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

/// RMS of the camera's position error of one run [m].
double PositionRms(std::uint64_t seed, double seconds, double false_matches) {
  PointsOptions options;
  options.seed = seed;
  options.duration_s = seconds;
  options.false_matches = false_matches;
  options.soft_gate = true;
  const PointsWorld world = MakePointsWorld(options);
  PointsFilter filter(world, options, PointsMode::kSlam);
  double sum = 0.0;
  for (std::size_t i = 0; i < world.frames.size(); ++i) {
    const auto step = filter.Step(i);
    EXPECT_TRUE(step.ok()) << step.status();
    if (!step.ok()) return 1e9;
    sum += step->position_error_m * step->position_error_m;
  }
  return std::sqrt(sum / static_cast<double>(world.frames.size()));
}

// T15: 30 % of the matches anywhere within their gates.
TEST(PointsFilter, FalseMatchesHardlyHurtT15) {
  constexpr int kRuns = 8;
  double clean = 0.0, dirty = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const double without = PositionRms(seed, 20, 0.0), with = PositionRms(seed, 20, 0.3);
    clean += without * without / kRuns;
    dirty += with * with / kRuns;
  }
  const double ratio = std::sqrt(dirty / clean);
  std::printf("T15: position error %.2f mm clean, %.2f mm with 30 %% false matches: %.2f times\n",
              1e3 * std::sqrt(clean), 1e3 * std::sqrt(dirty), ratio);
  EXPECT_LT(ratio, 1.5);
}

}  // namespace
}  // namespace saccade
