#include "server/map/place_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace saccade::place_graph_test {
namespace {

constexpr int kKeyframes = 101;  // the last is where the first was
constexpr double kRadius = 3.2;  // 20 m round

/// Once round a circle, looking ahead; with `drift` each step turns by 0.1 deg too much and every
/// length grows by 0.2 %.
KeyframeGraph::Outline Round(bool drift) {
  KeyframeGraph::Outline outline;
  Similarity3 here;
  here.translation = {kRadius, 0.0, 0.0};
  const double angle = 2.0 * M_PI / (kKeyframes - 1);
  for (int k = 0; k < kKeyframes; ++k) {
    outline.keyframes.push_back(
        {k, {here.rotation, here.translation}, /*distance_m=*/3.0 * here.scale, false});
    if (k >= 3) outline.ties.push_back({k - 3, k, 20});
    Similarity3 step;
    step.rotation = ExpQuaternion({0.0, angle + (drift ? 0.1 * M_PI / 180.0 : 0.0), 0.0});
    step.translation = {kRadius * (std::cos(angle) - 1.0), 0.0, -kRadius * std::sin(angle)};
    step.scale = drift ? 1.002 : 1.0;
    here = here * step;
  }
  return outline;
}

/// How the end of `drifted` lies on the beginning of the true way.
Loop Closed(const KeyframeGraph::Outline& truth, const KeyframeGraph::Outline& drifted) {
  Loop loop;
  loop.old_keyframe = 0;
  loop.new_keyframe = kKeyframes - 1;
  loop.old_from_new = Similarity3::FromRigid(truth.keyframes.back().world_from_camera) *
                      Similarity3{.scale = std::pow(1.002, -(kKeyframes - 1))} *
                      Similarity3::FromRigid(drifted.keyframes.back().world_from_camera.Inverse());
  loop.distance_m = 3.0;
  loop.log_scale_sigma = 0.002;
  loop.rigid_from = kKeyframes - 5;
  return loop;
}

double MeanError(const KeyframeGraph::Outline& truth, const KeyframeGraph::Outline& drifted,
                 const MapCorrection* correction) {
  double sum = 0.0;
  for (std::size_t k = 0; k < truth.keyframes.size(); ++k) {
    Rigid3 pose = drifted.keyframes[k].world_from_camera;
    if (correction != nullptr) pose = correction->Of(static_cast<KeyframeId>(k)).Move(pose);
    sum += (pose.translation - truth.keyframes[k].world_from_camera.translation).norm();
  }
  return sum / static_cast<double>(truth.keyframes.size());
}

TEST(PlaceGraph, ALoopPutsTheWholeWayRight) {
  const KeyframeGraph::Outline truth = Round(false), drifted = Round(true);
  const Rigid3& end = drifted.keyframes.back().world_from_camera;
  ASSERT_GT((end.translation - truth.keyframes.back().world_from_camera.translation).norm(), 0.5);
  const auto correction = CloseLoop(drifted, Closed(truth, drifted));
  ASSERT_TRUE(correction);
  EXPECT_LT((correction->newest().Move(end).translation -
             truth.keyframes.back().world_from_camera.translation)
                .norm(),
            0.01);
  EXPECT_NEAR(correction->newest().scale, std::pow(1.002, -(kKeyframes - 1)), 0.01);
  EXPECT_LT(5.0 * MeanError(truth, drifted, &*correction), MeanError(truth, drifted, nullptr));
}

TEST(PlaceGraph, TheBeginningStaysAndWhatTheFilterHasMovesAsOne) {
  const KeyframeGraph::Outline truth = Round(false), drifted = Round(true);
  const auto correction = CloseLoop(drifted, Closed(truth, drifted));
  ASSERT_TRUE(correction);
  EXPECT_LT(correction->Of(0).translation.norm(), 1e-12);
  EXPECT_EQ(correction->Of(kKeyframes - 5).translation, correction->newest().translation);
  EXPECT_EQ(correction->Of(kKeyframes + 7).scale, correction->newest().scale);
}

TEST(PlaceGraph, ALoopThatNoDriftExplainsIsRefused) {
  const KeyframeGraph::Outline drifted = Round(true);
  Loop loop = Closed(Round(false), drifted);
  loop.old_from_new.translation += Eigen::Vector3d(0.0, 300.0, 0.0);
  EXPECT_FALSE(CloseLoop(drifted, loop));
  loop.old_keyframe = kKeyframes + 3;  // forgotten meanwhile
  EXPECT_FALSE(CloseLoop(drifted, loop));
}

}  // namespace
}  // namespace saccade::place_graph_test
