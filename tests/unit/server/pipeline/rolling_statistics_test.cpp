#include "server/pipeline/rolling_statistics.hpp"

#include <gtest/gtest.h>

namespace saccade::rolling_statistics_test {
namespace {

constexpr Timestamp kMs = 1'000'000;

TEST(RollingStatistics, RateAndPercentilesOfTheWindow) {
  RollingStatistics statistics(1'000 * kMs);
  for (int i = 1; i <= 100; ++i) statistics.Add(i * 10 * kMs, i);
  const auto summary = statistics.At(1'000 * kMs);
  EXPECT_DOUBLE_EQ(summary.rate_hz, 100.0);
  EXPECT_DOUBLE_EQ(summary.sum_per_second, 5050.0);
  EXPECT_NEAR(summary.p50, 50.0, 1.0);
  EXPECT_NEAR(summary.p95, 95.0, 1.0);
}

TEST(RollingStatistics, ForgetsWhatIsOld) {
  RollingStatistics statistics(1'000 * kMs);
  statistics.Add(0, 1000.0);
  statistics.Add(1'500 * kMs, 2.0);
  EXPECT_DOUBLE_EQ(statistics.At(1'500 * kMs).p95, 2.0);
  EXPECT_DOUBLE_EQ(statistics.At(10'000 * kMs).rate_hz, 0.0);
  EXPECT_DOUBLE_EQ(RollingStatistics().At(0).p50, 0.0);
}

}  // namespace
}  // namespace saccade::rolling_statistics_test
