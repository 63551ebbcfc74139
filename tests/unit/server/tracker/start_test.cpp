// The start without a target, on a recording: tracked when the pictures hold the scale, not before.
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "server/capture/dataset.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::start_test {
namespace {

using Snapshot = std::shared_ptr<const MapSnapshot>;

class StartOfRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder =
        std::filesystem::path(SACCADE_SOURCE_DIR) / "../shared/data/tum_fr1_xyz";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "data set tum_fr1_xyz is not here";
    SourceOptions options;
    options.end_frame = 60;
    auto source = OpenDataset(folder, options);
    ASSERT_TRUE(source.ok()) << source.status();
    info_ = (*source)->info();
    for (auto frame = (*source)->Next(); frame.ok() && *frame; frame = (*source)->Next()) {
      frames_.push_back(**frame);
    }
    Begin(TrackerOptions());
  }

  void Begin(const TrackerOptions& options) {
    auto created = Tracker::Create(info_, options);
    ASSERT_TRUE(created.ok()) << created.status();
    tracker_ = *std::move(created);
    shown_ = 0;
  }

  Snapshot Show(Frame frame) {
    frame.id = shown_;
    frame.capture_time_ns = 1'000'000'000 + static_cast<Timestamp>(shown_++) * 33'333'333;
    return tracker_->Track(frame);
  }

  /// The first picture with a camera's noise, new each time: the same one again counts as none.
  Snapshot ShowAtRest() {
    Frame frame = frames_.front();
    cv::Mat noise(frame.grey.size(), CV_16SC1), noisy;
    random_.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
    frame.grey.convertTo(noisy, CV_16SC1);
    noisy += noise;
    noisy.convertTo(frame.grey = cv::Mat(), CV_8UC1);
    return Show(frame);
  }

  Snapshot Show(std::size_t index) { return Show(frames_[index]); }

  SourceInfo info_;
  cv::RNG random_{7};
  std::vector<Frame> frames_;
  std::unique_ptr<Tracker> tracker_;
  FrameId shown_ = 0;
};

TEST_F(StartOfRecording, AMovingCameraWaitsUnderASecondAndAHalf) {
  std::size_t first = 0;
  for (std::size_t k = 0; k < 45 && first == 0; ++k) {
    if (Show(k)->status == TrackingStatus::kTracking) first = k;
  }
  EXPECT_GT(first, 2u);
  EXPECT_LT(first, 45u);
}

TEST_F(StartOfRecording, ACameraAtRestIsNotCalledTracked) {
  Snapshot last;
  for (int k = 0; k < 60; ++k) {
    last = ShowAtRest();
    ASSERT_EQ(last->status, TrackingStatus::kInitialising) << k;
  }
  EXPECT_FALSE(last->advice.empty());
  EXPECT_GT(last->matched, 40);
  const std::uint64_t before = last->map_revision;
  for (std::size_t k = 0; k < 60; ++k) last = Show(k);
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
  EXPECT_GT(last->map_revision, before) << "the map was found anew: what was placed has moved";
}

TEST_F(StartOfRecording, WhatWasSeenFirstIsStillThereAfterwards) {
  const Snapshot first = Show(0);
  Snapshot last;
  for (std::size_t k = 1; k < 30; ++k) last = Show(k);
  ASSERT_EQ(last->status, TrackingStatus::kTracking);
  std::size_t kept = 0, known = 0;
  for (const FeatureSnapshot& before : first->features) {
    for (const FeatureSnapshot& now : last->features) {
      kept += now.id == before.id ? 1 : 0;
      known += now.id == before.id && now.depth_known ? 1 : 0;
    }
  }
  EXPECT_GT(2 * kept, first->features.size());
  EXPECT_GT(2 * known, kept);
}

TEST_F(StartOfRecording, TheOldStartDoesNotWait) {
  TrackerOptions options;
  options.start = false;
  Begin(options);
  Snapshot last;
  for (int k = 0; k < 20; ++k) last = ShowAtRest();
  EXPECT_EQ(last->status, TrackingStatus::kTracking) << "or there is nothing to compare with";
}

TEST_F(StartOfRecording, APictureThatComesAgainIsNoMeasurement) {
  Snapshot last;
  for (std::size_t k = 0; k < 40; ++k) last = Show(k);
  ASSERT_EQ(last->status, TrackingStatus::kTracking);
  const Rigid3 before = last->world_from_camera;
  for (int k = 0; k < 2; ++k) EXPECT_EQ(Show(39)->status, TrackingStatus::kTracking) << "a filler";
  for (int k = 0; k < 20; ++k) {
    last = Show(39);
    EXPECT_EQ(last->status, TrackingStatus::kCoasting);
    EXPECT_EQ(last->world_from_camera.translation, before.translation);
  }
}

// What was seen for less than two seconds is seldom found again: lost in it, one was lost for good.
TEST_F(StartOfRecording, AYoungMapThatIsNotFoundAgainMakesRoomForAnother) {
  for (std::size_t k = 0; k < 30; ++k) Show(k);
  const auto before = Show(30);
  ASSERT_EQ(before->status, TrackingStatus::kTracking);
  int lost = 0;
  Snapshot last;
  for (std::size_t k = 0; k < 110; ++k) {  // another place: the same in the mirror, to and fro
    Frame frame = frames_[k < 60 ? k : 119 - k];
    cv::Mat mirrored;
    cv::flip(frame.grey, mirrored, 1);
    frame.grey = mirrored;
    last = Show(frame);
    lost += last->status == TrackingStatus::kLost ? 1 : 0;
  }
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
  EXPECT_GT(lost, 20);
  EXPECT_LT(lost, 40);
}

// To the bit only from one process to the next: sums are taken in another order where memory lies
// otherwise.
TEST_F(StartOfRecording, TwoRunsAreTheSame) {
  std::vector<Rigid3> first;
  for (std::size_t k = 0; k < 40; ++k) first.push_back(Show(k)->world_from_camera);
  Begin(TrackerOptions());
  for (std::size_t k = 0; k < 40; ++k) {
    const Eigen::Vector3d apart = Show(k)->world_from_camera.translation - first[k].translation;
    EXPECT_LT(apart.norm(), 1e-9) << k;
  }
}

}  // namespace
}  // namespace saccade::start_test
