#include "server/map/landmark.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace saccade::landmark_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A landmark with a history: `matched` successes, then `failed` failures, one a frame.
Landmark WithHistory(LandmarkMap& map, int matched, int failed, std::int64_t first_frame = 0) {
  Landmark landmark;
  landmark.id = map.NextId();
  std::int64_t frame = first_frame;
  for (int k = 0; k < matched; ++k) landmark.Record(true, frame++);
  for (int k = 0; k < failed; ++k) landmark.Record(false, frame++);
  return landmark;
}

TEST(Landmark, RecordCountsAndRemembersTheLastSuccess) {
  Landmark landmark;
  landmark.Record(true, 7);
  landmark.Record(false, 8);
  landmark.Record(false, 9);
  EXPECT_EQ(landmark.attempted, 3U);
  EXPECT_EQ(landmark.matched, 1U);
  EXPECT_EQ(landmark.failed_in_row, 2U);
  EXPECT_EQ(landmark.last_matched_frame, 7);
  landmark.Record(true, 12);
  EXPECT_EQ(landmark.failed_in_row, 0U);
  EXPECT_EQ(landmark.last_matched_frame, 12);
}

TEST(Landmark, RecentShareForgetsOverAboutTwentyAttempts) {
  Landmark landmark;
  EXPECT_EQ(landmark.recent, 1.0);
  for (int k = 0; k < 20; ++k) landmark.Record(false, k);
  EXPECT_NEAR(landmark.recent, std::exp(-1.0), 0.02);
  for (int k = 0; k < 200; ++k) landmark.Record(true, 20 + k);
  EXPECT_NEAR(landmark.recent, 1.0, 1e-3);
}

TEST(LandmarkMap, FindsByIdAndNeverUsesAnIdTwice) {
  LandmarkMap map;
  for (int k = 0; k < 5; ++k) map.Add(WithHistory(map, 1, 0));
  const std::vector<FeatureId> gone = {2, 4, 77};
  map.Remove(gone);
  EXPECT_EQ(map.Find(2), nullptr);
  EXPECT_EQ(map.Find(77), nullptr);
  ASSERT_NE(map.Find(3), nullptr);
  EXPECT_EQ(map.Find(3)->id, 3U);
  map.Clear();
  EXPECT_EQ(map.Find(3), nullptr);
  EXPECT_EQ(map.NextId(), 6U);
}

TEST(Retirement, TheYoungGoWhenTheyFailMoreThanTheySucceed) {
  const RetirementOptions options;
  LandmarkMap map;
  map.Add(WithHistory(map, 0, 9));    // 1: not judged yet
  map.Add(WithHistory(map, 4, 6));    // 2: 40 % of ten
  map.Add(WithHistory(map, 5, 5));    // 3: just half
  map.Add(WithHistory(map, 39, 40));  // 4: still young by matches, less than half
  EXPECT_THAT(Unreliable(map, options), ElementsAre(2, 4));
}

TEST(Retirement, TheMatureOnesGoByFailuresInARowAlone) {
  const RetirementOptions options;
  const auto patience = static_cast<int>(options.mature_failures);
  LandmarkMap map;
  map.Add(WithHistory(map, 40, patience - 1));  // 1
  map.Add(WithHistory(map, 40, patience));      // 2
  Landmark seldom = WithHistory(map, 40, 0);    // 3: most attempts fail, never long in a row
  for (int k = 0; k < 300; ++k) seldom.Record(k % 20 == 0, 100 + k);
  map.Add(seldom);
  EXPECT_THAT(Unreliable(map, options), ElementsAre(2));
}

TEST(Retirement, KnownPointsStayAndSeededOnesTwiceAsLong) {
  const RetirementOptions options;
  const auto patience = static_cast<int>(options.mature_failures);
  LandmarkMap map;
  Landmark known = WithHistory(map, 0, 500);  // 1
  known.known.emplace();
  map.Add(known);
  const std::pair<int, int> histories[] = {
      {0, 19}, {0, 20}, {40, 2 * patience - 1}, {40, 2 * patience}};
  for (const auto& [matched, failed] : histories) {  // 2 to 5
    Landmark seeded = WithHistory(map, matched, failed);
    seeded.seeded = true;
    map.Add(seeded);
  }
  EXPECT_THAT(Unreliable(map, options), ElementsAre(3, 5));
}

TEST(Retirement, NothingIsUnreliableThatWasNeverTried) {
  LandmarkMap map;
  map.Add(WithHistory(map, 0, 0));
  EXPECT_THAT(Unreliable(map, RetirementOptions()), IsEmpty());
}

TEST(LeastWorth, ThoseOutOfSightFirstThenTheLeastMatched) {
  constexpr std::int64_t kNow = 1000;
  LandmarkMap map;
  map.Add(WithHistory(map, 50, 0, kNow - 50));  // 1: seen lately, often
  map.Add(WithHistory(map, 3, 0, kNow - 3));    // 2: seen lately, young
  map.Add(WithHistory(map, 80, 0, 0));          // 3: long ago, often
  map.Add(WithHistory(map, 5, 0, 0));           // 4: long ago, seldom
  map.Add(WithHistory(map, 5, 0, 0));           // 5: the same, younger id
  EXPECT_THAT(LeastWorth(map, 5, kNow), ElementsAre(4, 5, 3, 2, 1));
  EXPECT_THAT(LeastWorth(map, 2, kNow), ElementsAre(4, 5));
  EXPECT_THAT(LeastWorth(map, 0, kNow), IsEmpty());
  EXPECT_EQ(LeastWorth(map, 99, kNow).size(), 5U);
}

TEST(LeastWorth, SparesKnownAndSeededOnes) {
  LandmarkMap map;
  Landmark known = WithHistory(map, 0, 0), seeded = WithHistory(map, 0, 0);
  known.known.emplace();
  seeded.seeded = true;
  map.Add(known);
  map.Add(seeded);
  map.Add(WithHistory(map, 90, 0, 0));
  EXPECT_THAT(LeastWorth(map, 3, 1000), ElementsAre(3));
}

}  // namespace
}  // namespace saccade::landmark_test
