// T46: the lens is covered to 80 % for 3 s while the wearer sways on.
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::cover_test {
namespace {

constexpr FrameId kCovered = 150, kUncovered = 240, kEnd = 285;  // 3 s and 1.5 s at 30 Hz

/// A dark, soft thing close to the lens: 80 % of the picture, no edge that could be tracked.
void Cover(cv::Mat& grey) {
  constexpr double kShare = 0.8;
  cv::Mat hand(grey.size(), CV_8UC1, cv::Scalar(38));
  cv::randn(hand, 38, 2);
  cv::GaussianBlur(hand, hand, {0, 0}, 2.0);
  cv::Mat mask = cv::Mat::zeros(grey.size(), CV_8UC1);
  const int width = static_cast<int>(kShare * grey.cols);
  mask(cv::Rect(0, 0, width, grey.rows)).setTo(255);
  cv::Mat covered = grey.clone();
  hand.copyTo(covered, mask);
  grey = covered;
}

struct Outcome {
  int relocalised = 0, lost = 0;  // frames
  int back = -1;                  // frames after the cover left until tracking
  double worst_m = 0.0;           // position error from then on
};

Outcome CoverFor3s(const std::string& uri) {
  Outcome outcome;
  auto source = SimSource::OpenUri(uri, SourceOptions{});
  EXPECT_TRUE(source.ok()) << source.status();
  if (!source.ok()) return outcome;
  auto tracker = Tracker::Create((*source)->info(), TrackerOptions());
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  for (FrameId k = 0; k < kEnd && tracker.ok(); ++k) {
    auto frame = (*source)->Next();
    EXPECT_TRUE(frame.ok() && *frame);
    if (!frame.ok() || !*frame) break;
    if (k >= kCovered && k < kUncovered) Cover((*frame)->grey);
    const auto snapshot = (*tracker)->Track(**frame);
    outcome.relocalised += snapshot->status == TrackingStatus::kRelocalising ? 1 : 0;
    outcome.lost += snapshot->status == TrackingStatus::kLost ? 1 : 0;
    if (k < kUncovered || snapshot->status != TrackingStatus::kTracking) continue;
    if (outcome.back < 0) outcome.back = static_cast<int>(k - kUncovered);
    const Eigen::Vector3d truth = (*source)->WorldFromCamera(k).translation;
    outcome.worst_m =
        std::max(outcome.worst_m, (snapshot->world_from_camera.translation - truth).norm());
  }
  std::printf(
      "T46 %s: %d frames lost, %d relocalising; tracking %d frames after the cover left, "
      "worst error then %.1f mm\n",
      uri.c_str(), outcome.lost, outcome.relocalised, outcome.back, 1e3 * outcome.worst_m);
  return outcome;
}

// Some of the map stays in what is left of the view.
TEST(Cover, EightyPercentForThreeSecondsT46) {
  const Outcome outcome = CoverFor3s("desk?seed=4");
  EXPECT_EQ(outcome.relocalised, 0);
  EXPECT_EQ(outcome.lost, 0);
  EXPECT_GE(outcome.back, 0);
  EXPECT_LE(outcome.back, 10);
  EXPECT_LT(outcome.worst_m, 0.02);
}

// Nothing of the map stays in view: lost after half a second, and found again at the right place.
TEST(Cover, WithNothingLeftInViewThePlaceIsRecognised) {
  const Outcome outcome = CoverFor3s("desk?motion=sway&seed=3");
  EXPECT_GE(outcome.back, 0);
  EXPECT_LE(outcome.back, 10);
  EXPECT_LT(outcome.worst_m, 0.02);
}

}  // namespace
}  // namespace saccade::cover_test
