// The tracker as the server runs it: adjustments come when they come, and nobody waits for them.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::live_test {
namespace {

constexpr double kSeconds = 4.0;

struct Ridden {
  std::vector<Rigid3> poses;
  double worst_m = 0.0, waited_ms = 0.0;
  int tracked = 0;
  std::size_t keyframes = 0, keyframe_changes = 0;
  double keyframe_worst_m = 0.0;
};

/// What the tracker says of its keyframes after `frame`.
void SeeKeyframes(const SimSource& source, const KeyframePlaces& places, FrameId frame,
                  Ridden& ridden) {
  std::int64_t before = -1;
  for (const KeyframePlace& place : places.keyframes) {
    EXPECT_GT(place.id, before);
    before = place.id;
    EXPECT_LE(place.frame, frame);
    EXPECT_GT(place.distance_m, 0.0);
    const Rigid3 truth = source.WorldFromCamera(place.frame);
    ridden.keyframe_worst_m = std::max(
        ridden.keyframe_worst_m, (place.world_from_camera.translation - truth.translation).norm());
  }
  ridden.keyframes = places.keyframes.size();
  ++ridden.keyframe_changes;
}

/// The simulator's desk, one frame after the other as fast as they are drawn.
Ridden Ride(const TrackerOptions& options) {
  SimOptions sim;
  sim.duration_s = kSeconds;
  auto source = SimSource::Open(sim);
  EXPECT_TRUE(source.ok()) << source.status();
  auto tracker = Tracker::Create((*source)->info(), options);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  Ridden ridden;
  std::shared_ptr<const KeyframePlaces> places;
  for (auto frame = (*source)->Next(); frame.ok() && *frame; frame = (*source)->Next()) {
    const auto snapshot = (*tracker)->Track(**frame);
    const Rigid3 truth = (*source)->WorldFromCamera((*frame)->id);
    ridden.poses.push_back(snapshot->world_from_camera);
    ridden.waited_ms += snapshot->stage_ms.waited_ms;
    if (const auto now = (*tracker)->keyframes(); now && now != places) {
      SeeKeyframes(**source, *now, (*frame)->id, ridden);
      places = now;
    }
    if (snapshot->status != TrackingStatus::kTracking) continue;
    ++ridden.tracked;
    ridden.worst_m = std::max(ridden.worst_m,
                              (snapshot->world_from_camera.translation - truth.translation).norm());
  }
  return ridden;
}

TEST(LiveTracker, TakesAdjustmentsLateAndWaitsForNone) {
  TrackerOptions live, without;
  live.adjust_live = true;
  without.adjust = false;
  const Ridden ridden = Ride(live);
  ASSERT_EQ(ridden.poses.size(), 120u);
  EXPECT_EQ(ridden.tracked, 120);
  EXPECT_LT(ridden.worst_m, 0.03);
  EXPECT_LT(ridden.waited_ms / 120.0, 0.2) << "an adjustment lasts 30 ms";
  EXPECT_GT(ridden.keyframes, 10u);
  EXPECT_GT(ridden.keyframe_changes, ridden.keyframes / 2) << "they move when they are adjusted";
  EXPECT_LT(ridden.keyframe_worst_m, 0.03);
  const Ridden alone = Ride(without);
  EXPECT_EQ(alone.keyframes, 0u) << "without adjustment none are kept";
  double most = 0.0;
  for (std::size_t k = 0; k < 120; ++k) {
    most = std::max(most, (ridden.poses[k].translation - alone.poses[k].translation).norm());
  }
  EXPECT_GT(most, 1e-6) << "no adjustment was ever taken";
}

TEST(LiveTracker, OfflineItWaitsSoThatResultsRepeat) {
  TrackerOptions offline;
  const Ridden first = Ride(offline), second = Ride(offline);
  ASSERT_EQ(first.poses.size(), second.poses.size());
  for (std::size_t k = 0; k < first.poses.size(); ++k) {
    ASSERT_EQ(first.poses[k].translation, second.poses[k].translation) << k;
  }
}

}  // namespace
}  // namespace saccade::live_test
