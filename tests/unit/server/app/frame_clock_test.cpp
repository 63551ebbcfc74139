#include "server/app/frame_clock.hpp"

#include <gtest/gtest.h>

namespace saccade::frame_clock_test {
namespace {

constexpr Timestamp kMs = 1'000'000;

TEST(FrameClock, ALiveSourceIsOnTheMonotonicClock) {
  FrameClock clock;
  EXPECT_EQ(clock.ToMonotonic(5'000 * kMs, 5'009 * kMs), 5'000 * kMs);
  EXPECT_EQ(clock.ToMonotonic(5'033 * kMs, 5'200 * kMs), 5'033 * kMs);
}

TEST(FrameClock, ARecordingKeepsItsDistancesAndNeverComesFromTheFuture) {
  FrameClock clock;
  const Timestamp recorded = 1'305'031'102'000 * kMs;  // 2011
  // The first frame arrives 20 ms late, the second in time, the third 5 ms late.
  EXPECT_EQ(clock.ToMonotonic(recorded, 120 * kMs), 120 * kMs);
  EXPECT_EQ(clock.ToMonotonic(recorded + 33 * kMs, 133 * kMs), 133 * kMs);
  EXPECT_EQ(clock.ToMonotonic(recorded + 66 * kMs, 171 * kMs), 166 * kMs);
}

TEST(FrameClock, ARecordingThatStoodStillIsNotLateForEver) {
  FrameClock clock;
  const Timestamp recorded = 1'305'031'102'000 * kMs;
  EXPECT_EQ(clock.ToMonotonic(recorded, 100 * kMs), 100 * kMs);
  EXPECT_EQ(clock.ToMonotonic(recorded + 33 * kMs, 30'133 * kMs), 30'133 * kMs);  // 30 s of rest
  EXPECT_EQ(clock.ToMonotonic(recorded + 66 * kMs, 30'170 * kMs), 30'166 * kMs);
}

TEST(FrameClock, ALiveClockThatIsSetStaysNearArrival) {
  constexpr Timestamp kHour = 3'600'000 * kMs;
  for (const Timestamp by : {-kHour, kHour}) {
    FrameClock clock;
    const Timestamp now = 5 * kHour;
    EXPECT_EQ(clock.ToMonotonic(now, now + 9 * kMs), now);
    EXPECT_EQ(clock.ToMonotonic(now + 33 * kMs + by, now + 42 * kMs), now + 42 * kMs);
    EXPECT_EQ(clock.ToMonotonic(now + 66 * kMs + by, now + 75 * kMs), now + 75 * kMs);
  }
}

TEST(FrameClock, ARecordingWithAPauseThatWasCutShortStaysNearArrival) {
  FrameClock clock;
  EXPECT_EQ(clock.ToMonotonic(0, 100'000 * kMs), 100'000 * kMs);
  EXPECT_EQ(clock.ToMonotonic(3'600'000 * kMs, 105'000 * kMs), 105'000 * kMs);
  EXPECT_EQ(clock.ToMonotonic(3'600'033 * kMs, 105'033 * kMs), 105'033 * kMs);
}

TEST(FrameClock, WithoutPaceAFrameIsCapturedWhenItArrives) {
  FrameClock clock(/*paced=*/false);
  EXPECT_EQ(clock.ToMonotonic(33 * kMs, 9'000 * kMs), 9'000 * kMs);
  EXPECT_EQ(clock.ToMonotonic(66 * kMs, 9'500 * kMs), 9'500 * kMs);
}

}  // namespace
}  // namespace saccade::frame_clock_test
