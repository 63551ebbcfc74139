#include "server/anchors/depth_probe.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "server/sim/sim_source.hpp"

namespace saccade::depth_probe_test {
namespace {

constexpr FrameId kClicked = 150, kEnd = 156;

/// The simulated room seen by a tracker that makes no mistakes.
class DepthProbe : public ::testing::Test {
 protected:
  void Open(const std::string& uri) {
    auto source = SimSource::OpenUri(uri, SourceOptions{});
    ASSERT_TRUE(source.ok()) << source.status();
    source_ = *std::move(source);
    for (FrameId k = 0; k < kEnd; ++k) {
      auto frame = source_->Next();
      ASSERT_TRUE(frame.ok() && *frame);
      auto snapshot = std::make_shared<MapSnapshot>();
      snapshot->frame_id = k;
      snapshot->status = TrackingStatus::kTracking;
      snapshot->world_from_camera = source_->WorldFromCamera(k);
      ring_.Push({std::make_shared<const Frame>(**frame), snapshot});
    }
  }

  std::optional<ProbedDepth> Probe(const Eigen::Vector2d& pixel, double guess_m) {
    const FrameLookup lookup = [this](FrameId id) { return ring_.Find(id); };
    return ProbeDepth(*ring_.Find(kClicked), pixel, guess_m, kEnd - 1, lookup);
  }

  double TrueRange(const Eigen::Vector3d& point) const {
    return (source_->WorldFromCamera(kClicked).translation - point).norm();
  }

  std::unique_ptr<SimSource> source_;
  FrameRing ring_;
};

TEST_F(DepthProbe, FindsWhatWasClickedThoughTheGuessIsFarOff) {
  Open("desk?seed=2");
  const CameraModel& camera = *source_->info().camera;
  int asked = 0, found = 0;
  for (const SimObject& object : source_->Truth(kClicked).objects) {
    if (!object.visible || !object.pixel || !camera.InImage(*object.pixel, 40.0)) continue;
    const double truth = TrueRange(object.point_in_world);
    for (const double guess : {0.7 * truth, 1.0 * truth, 1.6 * truth}) {
      ++asked;
      const auto probed = Probe(*object.pixel, guess);
      if (!probed) continue;
      ++found;
      EXPECT_NEAR(probed->range_m, truth, 0.03 * truth) << object.name << ", guess " << guess;
      EXPECT_GT(probed->sigma_m, 0.0);
      EXPECT_LT(probed->sigma_m, 0.06 * probed->range_m);
    }
  }
  std::printf("%d of %d probes answered\n", found, asked);
  EXPECT_GE(found, 4);
  EXPECT_GE(3 * found, asked);
}

TEST_F(DepthProbe, SaysNothingWithoutParallax) {
  Open("desk?motion=still&seed=2");
  for (const SimObject& object : source_->Truth(kClicked).objects) {
    if (!object.visible || !object.pixel) continue;
    EXPECT_FALSE(Probe(*object.pixel, 1.0)) << object.name;
  }
}

TEST_F(DepthProbe, SaysNothingOfNonsense) {
  Open("desk?seed=2");
  EXPECT_FALSE(Probe({320, 240}, 0.0));
  EXPECT_FALSE(Probe({320, 240}, -1.0));
  EXPECT_FALSE(Probe({320, 240}, std::nan("")));
  EXPECT_FALSE(Probe({std::nan(""), 240}, 1.0));
  EXPECT_FALSE(Probe({-50, 240}, 1.0));
  EXPECT_FALSE(Probe({639, 479}, 1.0));
}

TEST(JoinDepth, WeighsWhatAgreesAndReplacesWhatDoesNot) {
  double range = 1.0, sigma = 0.03;
  JoinDepth({1.02, 0.03, 0.9, 8}, range, sigma);
  EXPECT_NEAR(range, 1.01, 1e-9);
  EXPECT_NEAR(sigma, 0.03 / std::sqrt(2.0), 1e-9);
  range = 1.0, sigma = 0.01;
  JoinDepth({0.7, 0.02, 0.9, 8}, range, sigma);
  EXPECT_EQ(range, 0.7);
  EXPECT_EQ(sigma, 0.02);
}

}  // namespace
}  // namespace saccade::depth_probe_test
