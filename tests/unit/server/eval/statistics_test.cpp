#include "server/eval/statistics.hpp"

#include <gtest/gtest.h>

namespace saccade::statistics_test {
namespace {

TEST(Sample, PercentilesAreNearestRank) {
  Sample sample;
  for (int i = 100; i >= 1; --i) sample.Add(i);
  EXPECT_EQ(sample.Percentile(50), 50);
  EXPECT_EQ(sample.Percentile(99), 99);
  EXPECT_EQ(sample.Percentile(100), 100);
  EXPECT_EQ(sample.Max(), 100);
  EXPECT_EQ(sample.Mean(), 50.5);
  EXPECT_EQ(Sample().Percentile(50), 0);
}

TEST(ChiSquareMeanBand, IsTheSpecificationsBandForFiftyRuns) {
  const Band band = ChiSquareMeanBand(6, 50);  // slam-spec section 12: [5.08, 7.00]
  EXPECT_NEAR(band.low, 5.08, 0.01);
  EXPECT_NEAR(band.high, 7.00, 0.01);
}

}  // namespace
}  // namespace saccade::statistics_test
