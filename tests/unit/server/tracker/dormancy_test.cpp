// Landmarks that leave the filter, full or out of sight, and come back into view.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "server/sim/corridor_source.hpp"
#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::dormancy_test {
namespace {

/// A tracker too small for all that it sees, and what of it is used when the camera is back.
struct Small {
  explicit Small(const SourceInfo& source, bool wake) {
    TrackerOptions options;
    options.max_features = 110;
    options.wake = wake;
    auto made = Tracker::Create(source, options);
    EXPECT_TRUE(made.ok()) << made.status();
    if (made.ok()) tracker = *std::move(made);
  }

  std::unique_ptr<Tracker> tracker;
  FeatureId newest = 0;       // before the camera turned away
  int old_ones_measured = 0;  // of those up to `newest`, when it was back
  std::size_t features = 0;   // published at the end
  double error_rad = 0;       // at the end
};

// On the heel, out and back.
TEST(Dormancy, WhatLeftAFullFilterIsMeasuredAgain) {
  auto source = SimSource::OpenUri("desk?motion=turn&seed=2", SourceOptions{});
  ASSERT_TRUE(source.ok()) << source.status();
  Small woken((*source)->info(), true), forgotten((*source)->info(), false);
  const Rigid3 begin = (*source)->WorldFromCamera(0);
  constexpr double kOut_rad = 1.0, kBack_rad = 0.2;
  constexpr int kEnough = 15;  // frames when back
  double farthest = 0;
  int back = 0;
  for (FrameId k = 0; k < 260 && back < kEnough; ++k) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame);
    const Rigid3 truth = (*source)->WorldFromCamera(k);
    const double away = RotationAngle(begin, truth);
    farthest = std::max(farthest, away);
    const bool is_back = farthest > kOut_rad && away < kBack_rad;
    back += is_back ? 1 : 0;
    for (Small* each : {&woken, &forgotten}) {
      const auto snapshot = each->tracker->Track(**frame);
      if (k == 36) each->newest = snapshot->features.back().id;
      if (!is_back) continue;
      int old_ones = 0;
      for (const FeatureSnapshot& feature : snapshot->features) {
        old_ones += feature.id <= each->newest && feature.state == FeatureState::kMeasured ? 1 : 0;
      }
      each->old_ones_measured = std::max(each->old_ones_measured, old_ones);
      each->features = snapshot->features.size();
      each->error_rad = RotationAngle(snapshot->world_from_camera, truth);
    }
  }
  EXPECT_EQ(back, kEnough);
  for (const Small* each : {&woken, &forgotten}) {
    std::printf("%s: %d old ones measured, %zu features, %.2f deg off at the end\n",
                each == &woken ? "wake" : "forget", each->old_ones_measured, each->features,
                57.3 * each->error_rad);
  }
  EXPECT_GT(woken.old_ones_measured, 20);
  EXPECT_GT(woken.old_ones_measured, 2 * forgotten.old_ones_measured);
  EXPECT_GT(woken.features, forgotten.features) << "what is at rest is part of the map";
  // With 110 features: 0.004 to 0.012 rad by one change of the tracker or another.
  EXPECT_LT(woken.error_rad, 0.02);
}

/// Follows how many of the landmarks that were seen first stay where they are, to the bit, from
/// frame to frame.
struct Watched {
  explicit Watched(const SourceInfo& source, int rest_after) {
    TrackerOptions options;
    options.rest_after = rest_after;
    auto made = Tracker::Create(source, options);
    EXPECT_TRUE(made.ok()) << made.status();
    if (made.ok()) tracker = *std::move(made);
  }

  void Track(const Frame& frame) {
    const auto snapshot = tracker->Track(frame);
    std::map<FeatureId, Eigen::Vector3d> now;
    for (const FeatureSnapshot& feature : snapshot->features) {
      now[feature.id] = feature.point_in_world;
    }
    if (frame.id == 36) newest = now.rbegin()->first;
    known = still = 0;
    for (const auto& [id, point] : now) {
      if (id > newest || !points.contains(id)) continue;
      ++known;
      still += points.at(id) == point ? 1 : 0;
    }
    points = std::move(now);
  }

  std::unique_ptr<Tracker> tracker;
  FeatureId newest = 0;
  std::map<FeatureId, Eigen::Vector3d> points;
  int known = 0, still = 0;
};

TEST(Dormancy, WhatIsOutOfSightStaysWhereItIs) {
  auto source = SimSource::OpenUri("desk?motion=turn&seed=2", SourceOptions{});
  ASSERT_TRUE(source.ok()) << source.status();
  Watched resting((*source)->info(), TrackerOptions().rest_after), kept((*source)->info(), 0);
  const Rigid3 begin = (*source)->WorldFromCamera(0);
  constexpr double kAway_rad = 1.2;
  int away = 0, most_kept_still = 0;
  double share = 0;
  for (FrameId k = 0; k < 260 && away < 60; ++k) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame);
    resting.Track(**frame);
    kept.Track(**frame);
    if (RotationAngle(begin, (*source)->WorldFromCamera(k)) < kAway_rad) continue;
    ++away;
    if (away <= TrackerOptions().rest_after) continue;
    most_kept_still = std::max(most_kept_still, kept.still);
    share = std::max(share, static_cast<double>(resting.still) / std::max(1, resting.known));
  }
  std::printf("away for %d frames: %d known, at most %.0f %% of them still; kept: %d of %d\n", away,
              resting.known, 100 * share, most_kept_still, kept.known);
  EXPECT_GT(resting.known, 30);
  EXPECT_GT(share, 0.5);
  EXPECT_EQ(most_kept_still, 0) << "in the filter all move with all";
}

/// Features in the filter that were in no picture for more than `frames`; in the published list
/// they come first, by rising ids, then what is at rest.
class OutOfSight {
 public:
  explicit OutOfSight(int frames) : frames_(frames) {}

  int Count(const MapSnapshot& snapshot) {
    int count = 0;
    FeatureId before = 0;
    for (const FeatureSnapshot& feature : snapshot.features) {
      if (feature.id <= before) break;
      before = feature.id;
      const auto at = last_seen_.try_emplace(feature.id, snapshot.frame_id).first;
      if (feature.pixel) at->second = snapshot.frame_id;
      count += snapshot.frame_id - at->second > frames_ ? 1 : 0;
    }
    return count;
  }

 private:
  FrameId frames_;
  std::map<FeatureId, FrameId> last_seen_;
};

// A walk leaves features behind that were seen too briefly to be of use later: they filled the
// filter up to its limit, and an update costs the square of what is in it.
TEST(Dormancy, WhatWasLeftBehindTooYoungToRestLeavesTheFilter) {
  CorridorOptions options;
  options.way_m = 6.0;
  CorridorSource source(options);
  const int patience = TrackerOptions().rest_after + 5;
  auto tracker = Tracker::Create(source.info(), TrackerOptions());
  ASSERT_TRUE(tracker.ok()) << tracker.status();
  OutOfSight out_of_sight(patience);
  int most = 0;
  std::size_t landmarks = 0;
  while (true) {
    const auto frame = source.Next();
    ASSERT_TRUE(frame.ok());
    if (!*frame) break;
    const auto snapshot = (*tracker)->Track(**frame);
    const int now = out_of_sight.Count(*snapshot);
    if ((*frame)->id > 150) most = std::max(most, now);
    landmarks = snapshot->features.size();
  }
  std::printf("%zu landmarks, at most %d in the filter that are long out of sight\n", landmarks,
              most);
  EXPECT_GT(landmarks, 250u);
  EXPECT_LT(most, 15);
}

}  // namespace
}  // namespace saccade::dormancy_test
