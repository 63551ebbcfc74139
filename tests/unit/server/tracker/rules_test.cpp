// The tracker's rules, each by itself, on matches made by hand.
#include <gtest/gtest.h>

#include "server/tracker/home.hpp"
#include "server/tracker/rest_policy.hpp"
#include "server/tracker/retirement.hpp"
#include "server/tracker/same_picture.hpp"
#include "server/tracker/settling.hpp"
#include "server/tracker/surprise.hpp"
#include "server/tracker/suspension.hpp"
#include "tests/unit/server/tracker/mapped_view.hpp"

namespace saccade::rules_test {
namespace {

using testing::MappedView;

constexpr double kWell = 0.01, kBadly = 0.5;  // sigma / inverse range

TEST(WantedHome, FollowsTheCameraOnceHardlyAnythingWasSeenFromHome) {
  MappedView view;
  const CloneId first = view.filter.AddClone(), second = view.filter.AddClone();
  std::vector<FeatureId> old, young;
  for (int k = 0; k < 4; ++k) old.push_back(view.Plant(first, kWell));
  for (int k = 0; k < 4; ++k) young.push_back(view.Plant(second, kWell));
  const HomeOptions options{.least_share = 0.3, .loose_tie_rad = 1.0};
  for (const FeatureId id : young) view.See(id);
  EXPECT_EQ(WantedHome(view.matches, view.filter, first, options), second);
  EXPECT_EQ(WantedHome(view.matches, view.filter, second, options), std::nullopt);
  for (const FeatureId id : old) view.See(id);
  EXPECT_EQ(WantedHome(view.matches, view.filter, first, options), std::nullopt)
      << "half of it is still seen from home";
}

TEST(WantedHome, StaysWhileThePlaceIsKnown) {
  MappedView view;
  const CloneId first = view.filter.AddClone(), second = view.filter.AddClone();
  view.Plant(first, kWell);
  view.See(view.Plant(second, kWell));
  const HomeOptions options{.least_share = 0.3};
  ASSERT_EQ(WantedHome(view.matches, view.filter, first, options), second);
  view.SeeKnown(99, {0, 0, 1});
  EXPECT_EQ(WantedHome(view.matches, view.filter, first, options), std::nullopt);
}

TEST(WantedHome, NeverMovesWithoutAShare) {
  MappedView view;
  const CloneId first = view.filter.AddClone(), second = view.filter.AddClone();
  view.Plant(first, kWell);
  view.See(view.Plant(second, kWell));
  EXPECT_EQ(WantedHome(view.matches, view.filter, first, {.least_share = 0.0}), std::nullopt);
}

TEST(Settling, WaitsForDepthButNotForever) {
  MappedView view;
  const CloneId clone = view.filter.AddClone();
  const SettlingOptions options{.known_features = 3, .longest_frames = 10};
  for (int k = 0; k < 2; ++k) view.See(view.Plant(clone, kWell));
  for (int k = 0; k < 5; ++k) view.See(view.Plant(clone, kBadly));
  EXPECT_FALSE(HasSettled(view.matches, view.filter, 5, options));
  EXPECT_TRUE(HasSettled(view.matches, view.filter, 10, options));
  view.See(view.Plant(clone, kWell));
  EXPECT_TRUE(HasSettled(view.matches, view.filter, 5, options));
}

TEST(Suspension, SearchesNothingInASaccadeAndAgainAfterIt) {
  Suspension suspension(2.0);
  constexpr double kFrame_s = 1.0 / 30.0;
  HeadMotion still, fast;
  fast.camera_from_next.rotation = ExpQuaternion({0.0, 3.0 * kFrame_s, 0.0});
  EXPECT_FALSE(suspension.Suspends(&still, kFrame_s));
  EXPECT_TRUE(suspension.Suspends(&fast, kFrame_s));
  EXPECT_TRUE(suspension.Suspends(&fast, kFrame_s));
  EXPECT_FALSE(suspension.Suspends(&still, kFrame_s));
  EXPECT_FALSE(suspension.Suspends(nullptr, kFrame_s)) << "no encoders, no suspension";
}

TEST(Surprise, WidensOnceAndOnlyWhoWasFollowed) {
  FrameMatches matches;
  EXPECT_FALSE(IsWorthWidening(matches, 30, 5));
  matches.surprised = true;
  EXPECT_TRUE(IsWorthWidening(matches, 30, 5));
  EXPECT_FALSE(IsWorthWidening(matches, 4, 5)) << "the frame before was blind, too";
}

TEST(Surprise, MakesRoomForThriceTheNoise) {
  MappedView once, thrice;
  const MotionNoise noise{4.0, 6.0};
  WidenAfterSurprise(CameraMotion(), 0.03, noise, {.noise_times = 1.0}, once.filter);
  WidenAfterSurprise(CameraMotion(), 0.03, noise, {.noise_times = 3.0}, thrice.filter);
  const double before = 1e-8;  // MappedView
  EXPECT_NEAR((thrice.filter.PoseCovariance()(0, 0) - before) /
                  (once.filter.PoseCovariance()(0, 0) - before),
              9.0, 1e-6);
}

class Resting : public ::testing::Test {
 protected:
  /// A feature with so many matches, in a map that kept the keyframe it was born in.
  FeatureId Grown(std::uint32_t matched, double relative_sigma = kWell) {
    const FeatureId id = view_.Plant(view_.filter.AddClone(), relative_sigma);
    view_.Keep();
    view_.Of(id).matched = matched;
    return id;
  }
  bool MayRest(FeatureId id) { return policy_.MayRest(view_.Of(id), view_.map, view_.filter); }

  MappedView view_;
  TrackerOptions options_;
  RestPolicy policy_{options_};
};

TEST_F(Resting, OnlyWhatWillBeFoundAgain) {
  EXPECT_TRUE(MayRest(Grown(20)));
  EXPECT_FALSE(MayRest(Grown(5))) << "too young";
  EXPECT_FALSE(MayRest(Grown(20, 0.3))) << "its depth is not known";
  const FeatureId clicked = Grown(20, 0.05);
  EXPECT_TRUE(MayRest(clicked));
  view_.Of(clicked).seeded = true;
  EXPECT_FALSE(MayRest(clicked)) << "a mark waits for its depth";
}

TEST_F(Resting, WhoWasWokenInVainTooOftenDoesNot) {
  const FeatureId id = Grown(20);
  view_.Of(id).woken = Landmark::Probation{.attempted = 8, .matched = 1, .failures = 1};
  const auto note = policy_.Judge(view_.Of(id), {.frame = 100}, view_.map, view_.filter);
  ASSERT_TRUE(note.has_value());
  EXPECT_FALSE(note->learnt) << "it has taught the filter nothing";
  EXPECT_EQ(note->failures, 2);
  EXPECT_GT(note->rests_until, 100);
  view_.Of(id).woken->failures = 2;
  EXPECT_FALSE(MayRest(id));
}

TEST_F(Resting, RetirementTellsRestFromForgetting) {
  const FeatureId good = Grown(20), young = Grown(5), seen = Grown(20);
  constexpr std::int64_t kFrame = 1000;
  view_.Of(seen).last_in_view_frame = kFrame;
  const Retirement retirement(options_);
  // A camera that only turned keeps all of it.
  retirement.Apply({.frame = kFrame}, view_.map, view_.filter);
  EXPECT_EQ(view_.map.StateOf(good, view_.filter), LandmarkState::kInFilter);
  view_.Walk(0.5);
  retirement.Apply({.frame = kFrame}, view_.map, view_.filter);
  EXPECT_EQ(view_.map.StateOf(good, view_.filter), LandmarkState::kAtRest);
  EXPECT_EQ(view_.map.StateOf(young, view_.filter), LandmarkState::kGone);
  EXPECT_EQ(view_.map.StateOf(seen, view_.filter), LandmarkState::kInFilter);
  const auto where = view_.map.Where(good, view_.filter);
  ASSERT_TRUE(where.has_value());
  EXPECT_NEAR(where->norm(), 1.0, 1e-6) << "its keyframe knows where it is";
}

TEST_F(Resting, AFullFilterLetsTheLeastWorthGo) {
  options_.max_features = 2;
  const FeatureId best = Grown(50), good = Grown(30), least = Grown(20);
  Retirement(options_).Apply({.frame = 10}, view_.map, view_.filter);
  EXPECT_TRUE(view_.filter.Has(best) && view_.filter.Has(good));
  EXPECT_EQ(view_.map.StateOf(least, view_.filter), LandmarkState::kAtRest);
}

TEST_F(Resting, ACheckpointBringsBackWhatWasWoken) {
  const FeatureId id = Grown(20);
  view_.Walk(0.5);
  Retirement(options_).Apply({.frame = 1000}, view_.map, view_.filter);
  ASSERT_EQ(view_.map.StateOf(id, view_.filter), LandmarkState::kAtRest);
  const Map::Checkpoint before = view_.map.Save(view_.filter);
  const KeyframeId keyframe = view_.map.Recall(id)->anchor;
  view_.map.Wake(keyframe, std::array{id}, 1e-6 * Matrix6d::Identity(), 1001, view_.filter);
  ASSERT_EQ(view_.map.StateOf(id, view_.filter), LandmarkState::kInFilter);
  view_.map.Restore(before, view_.filter);
  EXPECT_EQ(view_.map.StateOf(id, view_.filter), LandmarkState::kAtRest);
  EXPECT_FALSE(view_.filter.Has(id));
  EXPECT_EQ(view_.map.in_use().Find(id), nullptr);
}

TEST(SamePicture, IsOneToTheBit) {
  cv::Mat picture(48, 64, CV_8UC1);
  cv::randu(picture, 0, 255);
  cv::Mat other = picture.clone();
  EXPECT_TRUE(SamePicture(picture, other));
  other.at<unsigned char>(47, 63) ^= 1;
  EXPECT_FALSE(SamePicture(picture, other));
  EXPECT_FALSE(SamePicture(picture, picture.rowRange(0, 47)));
}

}  // namespace
}  // namespace saccade::rules_test
