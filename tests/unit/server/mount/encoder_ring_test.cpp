#include "server/mount/encoder_ring.hpp"

#include <gtest/gtest.h>

namespace saccade::encoder_ring_test {
namespace {

constexpr Timestamp kMs = 1'000'000;

EncoderRing Ramp() {
  EncoderRing ring(1000 * kMs, 100 * kMs);
  for (int k = 0; k <= 10; ++k) ring.Add({k * 10 * kMs, {0.01 * k, -0.02 * k, 0}});
  return ring;
}

TEST(EncoderRing, InterpolatesToMidExposure) {
  const EncoderRing ring = Ramp();
  const auto at = ring.At(34 * kMs);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->pan_rad, 0.034, 1e-12);
  EXPECT_NEAR(at->elevation_rad, -0.068, 1e-12);
  EXPECT_NEAR(ring.At(50 * kMs)->pan_rad, 0.05, 1e-12);
}

TEST(EncoderRing, CarriesTheNewestOnByItsRateForALittleWhile) {
  const EncoderRing ring = Ramp();
  EXPECT_NEAR(ring.At(120 * kMs)->pan_rad, 0.12, 1e-9);
  EXPECT_FALSE(ring.At(201 * kMs));
}

TEST(EncoderRing, SaysNothingBeforeTheOldestOrInAGap) {
  EncoderRing ring(1000 * kMs, 100 * kMs);
  EXPECT_FALSE(ring.At(0));
  ring.Add({100 * kMs, {1, 0, 0}});
  EXPECT_FALSE(ring.At(99 * kMs));
  EXPECT_EQ(ring.At(120 * kMs)->pan_rad, 1.0);
  ring.Add({300 * kMs, {2, 0, 0}});
  EXPECT_FALSE(ring.At(200 * kMs));
}

TEST(EncoderRing, KeepsOrderAndForgetsTheOld) {
  EncoderRing ring(50 * kMs, 100 * kMs);
  EXPECT_TRUE(ring.Add({10 * kMs, {}}));
  EXPECT_FALSE(ring.Add({10 * kMs, {}}));
  EXPECT_FALSE(ring.Add({5 * kMs, {}}));
  for (int k = 2; k < 100; ++k) ring.Add({k * 10 * kMs, {}});
  EXPECT_EQ(ring.size(), 6u);
}

}  // namespace
}  // namespace saccade::encoder_ring_test
