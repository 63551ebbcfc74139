// Landmarks that the filter has no room for, and that come back into view.
#include <gtest/gtest.h>

#include <cstdio>

#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

struct Outcome {
  int old_ones_measured = 0;  // of those known before the camera turned away, when it is back
  std::size_t features = 0;   // published at the end
  double error_rad = 0;       // at the end
};

/// On the heel, out and back (about 7 s); the filter is too small for all that is seen.
Outcome TurnOutAndBack(bool wake) {
  Outcome outcome;
  auto source = SimSource::OpenUri("desk?motion=turn&seed=2", SourceOptions{});
  EXPECT_TRUE(source.ok()) << source.status();
  TrackerOptions options;
  options.max_features = 110;
  options.wake = wake;
  auto tracker = Tracker::Create((*source)->info(), options);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  FeatureId newest = 0;
  double farthest = 0;
  const Rigid3 begin = (*source)->WorldFromCamera(0);
  for (FrameId k = 0; k < 260; ++k) {
    const auto frame = (*source)->Next();
    EXPECT_TRUE(frame.ok() && *frame);
    if (!frame.ok() || !*frame) break;
    const auto snapshot = (*tracker)->Track(**frame);
    const Rigid3 truth = (*source)->WorldFromCamera(k);
    if (k == 36) newest = snapshot->features.back().id;
    const double away = RotationAngle(begin, truth);
    farthest = std::max(farthest, away);
    if (farthest < 1.0 || away > 0.2) continue;  // back from more than 57 deg
    int old_ones = 0;
    for (const FeatureSnapshot& feature : snapshot->features) {
      old_ones += feature.id <= newest && feature.state == FeatureState::kMeasured ? 1 : 0;
    }
    outcome.old_ones_measured = std::max(outcome.old_ones_measured, old_ones);
    outcome.features = snapshot->features.size();
    outcome.error_rad = RotationAngle(snapshot->world_from_camera, truth);
  }
  EXPECT_GT(farthest, 1.0);
  std::printf("%s: %d old ones measured, %zu features, %.2f deg off at the end\n",
              wake ? "wake" : "forget", outcome.old_ones_measured, outcome.features,
              outcome.error_rad * 57.3);
  return outcome;
}

TEST(Dormancy, WhatLeftAFullFilterIsMeasuredAgain) {
  const Outcome woken = TurnOutAndBack(true), forgotten = TurnOutAndBack(false);
  EXPECT_GT(woken.old_ones_measured, 20);
  EXPECT_GT(woken.old_ones_measured, 2 * forgotten.old_ones_measured);
  EXPECT_GT(woken.features, forgotten.features) << "what is at rest is part of the map";
  EXPECT_LT(woken.error_rad, 0.01);
}

}  // namespace
}  // namespace saccade
