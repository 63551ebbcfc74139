#include "server/eval/consistency.hpp"

#include <gtest/gtest.h>

#include <random>

namespace saccade::consistency_test {
namespace {

/// 50 runs of 400 steps of a filter whose errors are `factor` times what it believes.
nlohmann::ordered_json ReportOf(double factor) {
  ConsistencyTally tally(400);
  std::mt19937_64 rng(4);
  std::chi_squared_distribution<double> pose(6), pixels(2 * 20);
  for (int run = 0; run < 50; ++run) {
    for (std::size_t step = 0; step < 400; ++step) {
      tally.Add(step, factor * factor * pose(rng), factor * factor * pixels(rng), 20);
    }
  }
  return tally.Report();
}

TEST(Consistency, AConsistentFilterIsInBandNineteenTimesInTwenty) {
  const auto report = ReportOf(1.0);
  EXPECT_NEAR(report["nees_mean"].get<double>(), 6.0, 0.1);
  EXPECT_NEAR(report["nis_per_match_mean"].get<double>(), 2.0, 0.02);
  EXPECT_NEAR(report["nees_steps_in_band_fraction"].get<double>(), 0.95, 0.03);
  EXPECT_NEAR(report["nis_steps_in_band_fraction"].get<double>(), 0.95, 0.03);
}

TEST(Consistency, OverConfidenceAndTimidityAreToldApart) {
  EXPECT_GT(ReportOf(1.3)["nees_steps_above_band_fraction"].get<double>(), 0.95);
  EXPECT_GT(ReportOf(0.7)["nees_steps_below_band_fraction"].get<double>(), 0.95);
}

}  // namespace
}  // namespace saccade::consistency_test
