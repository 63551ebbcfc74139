#include "server/sim/sim_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "tests/unit/server/sim/open_sim.hpp"

namespace saccade::sim_source_test {
namespace {

/// Largest distance [px] between detected chessboard corners and where truth projects them.
void ExpectCornersWhereTruthSays(SimSource& source, FrameId frame, double tolerance_px) {
  const auto& board = std::get<ChessboardTarget>(*source.info().target);
  const absl::StatusOr<cv::Mat> picture = source.RenderClean(frame);
  ASSERT_TRUE(picture.ok()) << picture.status();
  cv::Mat grey;
  cv::cvtColor(*picture, grey, cv::COLOR_BGR2GRAY);
  std::vector<cv::Point2f> corners;
  ASSERT_TRUE(cv::findChessboardCornersSB(grey, {board.columns, board.rows}, corners));
  if (corners.front().x > corners.back().x) std::reverse(corners.begin(), corners.end());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto columns = static_cast<std::size_t>(board.columns);
    const Eigen::Vector3d point(static_cast<double>(k % columns) * board.square_m,
                                static_cast<double>(k / columns) * board.square_m, 0);
    const auto pixel = source.PixelOf(frame, point);
    ASSERT_TRUE(pixel);
    const Eigen::Vector2d error = Eigen::Vector2d(corners[k].x, corners[k].y) - *pixel;
    EXPECT_LT(error.norm(), tolerance_px) << "frame " << frame << " corner " << k;
    mean += error / static_cast<double>(corners.size());
  }
  EXPECT_LT(mean.norm(), 0.1) << "frame " << frame << ": pictures are shifted against truth";
}

TEST(SimSource, ChessboardCornersLieWhereTruthProjectsThem) {
  for (const char* uri :
       {"desk?seed=5&auto_exposure=off", "desk?lens=pinhole&motion=sway&seed=9"}) {
    const std::unique_ptr<SimSource> source = OpenSim(uri);
    ASSERT_NE(source, nullptr);
    for (const FrameId frame : {0, 60, 100}) ExpectCornersWhereTruthSays(*source, frame, 0.3);
  }
}

class SimSourceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { source_ = OpenSim("desk?duration=2").release(); }
  static void TearDownTestSuite() {
    delete source_;
    source_ = nullptr;
  }
  void SetUp() override { ASSERT_NE(source_, nullptr); }
  static SimSource* source_;
};
SimSource* SimSourceTest::source_ = nullptr;

TEST_F(SimSourceTest, RaysAgreeWithTheDrawnDepth) {
  const absl::StatusOr<cv::Mat> depth = source_->RenderDepth(40);
  ASSERT_TRUE(depth.ok()) << depth.status();
  const Rigid3 camera_from_world = source_->WorldFromCamera(40).Inverse();
  int agree = 0, tried = 0;
  for (int v = 7; v < depth->rows; v += 13) {
    for (int u = 5; u < depth->cols; u += 13) {
      const auto point = source_->PointAt(40, Eigen::Vector2d(u, v));
      ASSERT_TRUE(point) << u << " " << v;  // the room is closed
      const double z = (camera_from_world * *point).z();
      ++tried;
      agree += std::abs(z - static_cast<double>(depth->at<float>(v, u))) < 0.004 + 0.004 * z;
    }
  }
  // Only pixels on the outline of something may see past it by half a pixel.
  EXPECT_GT(agree, 0.97 * tried);
}

TEST_F(SimSourceTest, PointAndPixelAreInverse) {
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(320, 240), Eigen::Vector2d(33.3, 411.7)}) {
    const auto point = source_->PointAt(3, pixel);
    ASSERT_TRUE(point);
    EXPECT_TRUE(source_->Visible(3, *point));
    const auto back = source_->PixelOf(3, *point);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - pixel).norm(), 0.01);
  }
}

TEST_F(SimSourceTest, WhatIsBehindSomethingIsNotVisible) {
  const auto point = source_->PointAt(0, {320, 240});
  ASSERT_TRUE(point);
  const Eigen::Vector3d eye = source_->WorldFromCamera(0).translation;
  EXPECT_FALSE(source_->Visible(0, eye + 1.1 * (*point - eye)));
  EXPECT_FALSE(source_->Visible(0, eye - (*point - eye)));  // behind the camera
}

TEST_F(SimSourceTest, FramesDependOnTheOptionsAndTheirNumberAlone) {
  const std::unique_ptr<SimSource> same = OpenSim("desk?duration=2");
  const std::unique_ptr<SimSource> late = OpenSim("desk?duration=2", Frames(2, 4));
  ASSERT_TRUE(same && late);
  std::vector<Frame> frames;
  for (int k = 0; k < 4; ++k) {
    const auto frame = same->Next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    frames.push_back(**frame);
  }
  for (FrameId k = 2; k < 4; ++k) {
    const auto frame = late->Next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    EXPECT_EQ((*frame)->id, k);
    EXPECT_EQ(cv::norm((*frame)->color, frames[k].color, cv::NORM_INF), 0);
    EXPECT_EQ((*frame)->capture_time_ns, frames[k].capture_time_ns);
  }
  EXPECT_FALSE(late->Next()->has_value());
  EXPECT_EQ(frames[3].capture_time_ns, 100'000'000);
  EXPECT_EQ(frames[0].grey.type(), CV_8UC1);
  EXPECT_EQ(frames[0].grey.size(), cv::Size(640, 480));
  // Noise is new in each frame and close to what was asked for.
  const absl::StatusOr<cv::Mat> clean = source_->RenderClean(0);
  ASSERT_TRUE(clean.ok());
  cv::Mat difference;
  cv::subtract(frames[0].color, *clean, difference, cv::noArray(), CV_32F);
  const double sigma =
      cv::norm(difference) / std::sqrt(static_cast<double>(difference.total()) * 3);
  EXPECT_GT(sigma, 0.9);
  EXPECT_LT(sigma, 2.5);
}

TEST_F(SimSourceTest, EndsAfterItsDurationAndKnowsItsLength) {
  EXPECT_EQ(source_->info().frame_count, 60u);
  const std::unique_ptr<SimSource> brief = OpenSim("desk?duration=0.1&width=160&height=120");
  ASSERT_NE(brief, nullptr);
  int frames = 0;
  while (brief->Next()->has_value()) ++frames;
  EXPECT_EQ(frames, 3);
  EXPECT_FALSE(brief->Next()->has_value());
}

TEST_F(SimSourceTest, RealtimeKeepsTheClockAndDropsWhatALateReaderMissed) {
  SourceOptions realtime;
  realtime.realtime = true;
  const std::unique_ptr<SimSource> live = OpenSim("desk?width=160&height=120", realtime);
  ASSERT_NE(live, nullptr);
  const auto first = live->Next();
  ASSERT_TRUE(first.ok() && first->has_value());
  const auto second = live->Next();
  ASSERT_TRUE(second.ok() && second->has_value());
  EXPECT_LE((*second)->capture_time_ns, (*second)->received_time_ns);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const auto late = live->Next();
  ASSERT_TRUE(late.ok() && late->has_value());
  EXPECT_GE((*late)->id, (*second)->id + 10);
  // The clock does not slip: time stamps stay on the grid of the first.
  const auto steps = static_cast<std::int64_t>((*late)->id - (*first)->id);
  EXPECT_NEAR(static_cast<double>((*late)->capture_time_ns - (*first)->capture_time_ns),
              static_cast<double>(steps) * 1e9 / 30.0, 2.0);
}

TEST_F(SimSourceTest, BlurSmearsOnlyWhenThereIsMotion) {
  const auto contrast = [](const cv::Mat& picture) {
    cv::Mat grey, edges;
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    cv::Laplacian(grey, edges, CV_32F);
    return cv::norm(edges);
  };
  const std::unique_ptr<SimSource> blurred = OpenSim("desk?motion=turn&exposure_ms=20");
  const std::unique_ptr<SimSource> sharp = OpenSim("desk?motion=turn&blur=off");
  ASSERT_TRUE(blurred && sharp);
  EXPECT_NEAR(contrast(*blurred->RenderClean(0)) / contrast(*sharp->RenderClean(0)), 1.0, 0.1);
  double fastest = 0;
  FrameId turning = 0;
  for (FrameId k = 0; k < 120; ++k) {
    const double angle = RotationAngle(sharp->WorldFromCamera(k), sharp->WorldFromCamera(k + 1));
    if (angle > fastest) {
      fastest = angle;
      turning = k;
    }
  }
  EXPECT_LT(contrast(*blurred->RenderClean(turning)), 0.7 * contrast(*sharp->RenderClean(turning)));
}

TEST(SimSourceOpen, RefusesACameraFileAndUnknownKeys) {
  SourceOptions with_camera;
  with_camera.camera_file = "camera.yaml";
  EXPECT_EQ(SimSource::OpenUri("desk", with_camera).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(SimSource::OpenUri("desk?sped=2", {}).status().message()),
              ::testing::HasSubstr("sped"));
}

}  // namespace
}  // namespace saccade::sim_source_test
