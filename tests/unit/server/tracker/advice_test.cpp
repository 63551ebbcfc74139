#include "server/tracker/advice.hpp"

#include <gtest/gtest.h>

#include "server/tracker/picture_rate.hpp"

namespace saccade::advice_test {
namespace {

bool Contains(const std::string& text, const char* words) {
  return text.find(words) != std::string::npos;
}

StatusMonitor Tracking() {
  StatusMonitor monitor{TrackerOptions()};
  for (int k = 0; k < 10; ++k) monitor.Record(50, 48, true);
  return monitor;
}

StatusMonitor Lost() {
  StatusMonitor monitor = Tracking();
  while (monitor.status() != TrackingStatus::kLost) monitor.Record(50, 0, true);
  return monitor;
}

TEST(Advice, SaysWhatToDo) {
  Difficulties seen;
  seen.in_view = 50;
  EXPECT_EQ(AdviceFor(Tracking(), seen), "");
  seen.speed_rad_s = 2.5;
  EXPECT_NE(AdviceFor(Tracking(), seen), "");
  EXPECT_NE(AdviceFor(Lost(), Difficulties()), "");
}

TEST(Advice, WhereRotationIsFollowedWithoutDepthItSaysOrientationOnly) {
  StatusMonitor monitor{TrackerOptions()};
  monitor.Record(50, 48, false);
  EXPECT_FALSE(Contains(AdviceFor(monitor, Difficulties()), "orientation only"));
  Difficulties seen;
  seen.turns_followed = true;
  EXPECT_TRUE(Contains(AdviceFor(monitor, seen), "orientation only"));
  EXPECT_TRUE(Contains(AdviceFor(monitor, seen), "sideways")) << "and what ends it";
}

TEST(Advice, NamesTheRateWherePicturesAreTooFew) {
  Difficulties seen;
  seen.too_few_hz = 5.1;
  StatusMonitor starting{TrackerOptions()}, coasting = Tracking();
  starting.Record(50, 20, false);
  coasting.Record(50, 4, true);
  for (const StatusMonitor& monitor : {starting, coasting, Lost()}) {
    EXPECT_TRUE(
        Contains(AdviceFor(monitor, seen), "5 pictures a second are too few for this motion"))
        << AdviceFor(monitor, seen);
  }
  seen.in_view = 50;
  EXPECT_EQ(AdviceFor(Tracking(), seen), "") << "what is tracked needs no advice";
  seen.too_few_hz = 1.0;
  EXPECT_TRUE(Contains(AdviceFor(Lost(), seen), "1 picture a second is too few"));
  seen.too_few_hz = 0.4;
  EXPECT_TRUE(Contains(AdviceFor(Lost(), seen), "0.4 pictures a second are too few"));
}

/// Pictures `interval_s` apart; in each, `accepted` of 50 searches succeed.
PictureRate After(double interval_s, int accepted, std::optional<double> moved_px) {
  PictureRate rate;
  for (int k = 0; k < 10; ++k) {
    rate.Add(interval_s);
    rate.Record(50, accepted, moved_px);
  }
  return rate;
}

TEST(PictureRate, IsTooLowWhereThingsMoveAndAreNotFound) {
  EXPECT_NEAR(After(0.2, 10, 40.0).TooFew().value_or(0.0), 5.0, 1e-6);
  EXPECT_NEAR(After(0.2, 0, std::nullopt).TooFew().value_or(0.0), 5.0, 1e-6);
  EXPECT_FALSE(After(1.0 / 30.0, 10, 40.0).TooFew()) << "thirty are enough";
  EXPECT_FALSE(After(0.2, 40, 40.0).TooFew()) << "all is found";
  EXPECT_FALSE(After(0.2, 10, 1.0).TooFew()) << "nothing moves: it is something else";
}

TEST(PictureRate, OneDroppedPictureIsNoRate) {
  PictureRate rate = After(1.0 / 30.0, 10, 40.0);
  rate.Add(0.5);
  EXPECT_FALSE(rate.TooFew());
}

TEST(PictureRate, EndsWhenThingsAreFoundAgain) {
  PictureRate rate = After(0.2, 10, 40.0);
  for (int k = 0; k < 3; ++k) rate.Record(50, 45, 40.0);
  EXPECT_FALSE(rate.TooFew());
}

TEST(PictureRate, BelowOnePictureASecondNothingIsFollowed) {
  PictureRate rate;
  for (int k = 0; k < 4; ++k) rate.Add(2.0);
  EXPECT_NEAR(rate.TooFew().value_or(0.0), 0.5, 1e-6);
}

}  // namespace
}  // namespace saccade::advice_test
