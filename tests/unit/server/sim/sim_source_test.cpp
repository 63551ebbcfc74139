#include "server/sim/sim_source.hpp"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

std::unique_ptr<SimSource> OpenOrDie(const std::string& rest) {
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::OpenUri(rest, {});
  EXPECT_TRUE(source.ok()) << source.status();
  return source.ok() ? *std::move(source) : nullptr;
}

TEST(SimSource, ChessboardCornersLieWhereTruthProjectsThem) {
  for (const char* uri : {"desk", "desk?motion=sway&seed=5", "desk?lens=pinhole&motion=sway&seed=9"}) {
    const std::unique_ptr<SimSource> source = OpenOrDie(uri);
    ASSERT_NE(source, nullptr);
    const auto& board = std::get<ChessboardTarget>(*source->info().target);
    for (const FrameId frame : {0, 60}) {
      const absl::StatusOr<cv::Mat> picture = source->RenderClean(frame);
      ASSERT_TRUE(picture.ok()) << picture.status();
      if (const char* out = std::getenv("SIM_OUT")) cv::imwrite(std::string(out) + "/" + std::to_string(frame) + ".png", *picture);
      cv::Mat grey;
      cv::cvtColor(*picture, grey, cv::COLOR_BGR2GRAY);
      std::vector<cv::Point2f> corners;
      ASSERT_TRUE(cv::findChessboardCornersSB(grey, {board.columns, board.rows}, corners));
      if (corners.front().x > corners.back().x) std::reverse(corners.begin(), corners.end());
      double sum = 0, worst = 0;
      for (int k = 0; k < board.columns * board.rows; ++k) {
        const Eigen::Vector3d point(k % board.columns * board.square_m, k / board.columns * board.square_m, 0);
        const auto pixel = source->PixelOf(frame, point);
        ASSERT_TRUE(pixel);
        const double error = (*pixel - Eigen::Vector2d(corners[k].x, corners[k].y)).norm();
        sum += error;
        worst = std::max(worst, error);
      }
      std::printf("%s %d mean %.3f worst %.3f px\n", uri, int(frame), sum / 54, worst);
      EXPECT_LT(worst, 0.3);
    }
  }
}

}  // namespace
}  // namespace saccade
