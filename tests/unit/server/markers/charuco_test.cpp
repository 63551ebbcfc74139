#include "server/markers/charuco.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "server/markers/aruco_detector.hpp"

namespace saccade::charuco_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kSquare_px = 160;

/// The board as printed, seen at a slant, with soft edges and noise.
cv::Mat Slanted(const CharucoPattern& pattern) {
  const auto family = MakeArucoFamily(pattern.family);
  const auto board = cv::aruco::CharucoBoard::create(
      pattern.columns, pattern.rows, static_cast<float>(pattern.square_m),
      static_cast<float>(pattern.marker_m), family->dictionary);
  cv::Mat print;
  const float width = static_cast<float>(pattern.columns * kSquare_px);
  const float height = static_cast<float>(pattern.rows * kSquare_px);
  board->draw(cv::Size(pattern.columns * kSquare_px, pattern.rows * kSquare_px), print);
  cv::GaussianBlur(print, print, {}, 1.5);  // it is made smaller
  const cv::Point2f from[] = {{0, 0}, {width, 0}, {width, height}, {0, height}};
  const cv::Point2f to[] = {{120, 70}, {560, 110}, {520, 400}, {90, 420}};
  cv::Mat seen;
  cv::warpPerspective(print, seen, cv::getPerspectiveTransform(from, to), cv::Size(640, 480),
                      cv::INTER_AREA, cv::BORDER_CONSTANT, cv::Scalar(190));
  cv::Mat noise(seen.size(), CV_16S);
  cv::theRNG().state = 7;
  cv::randn(noise, 0, 2);
  cv::add(seen, noise, seen, {}, CV_8U);
  return seen;
}

/// Root mean square distance of the corners from one view of the board's plane [px].
double MissedBy(const std::vector<CharucoCorner>& corners) {
  std::vector<cv::Point2d> points, pixels, predicted;
  for (const CharucoCorner& corner : corners) {
    points.emplace_back(corner.point_m.x(), corner.point_m.y());
    pixels.emplace_back(corner.pixel.x(), corner.pixel.y());
  }
  cv::perspectiveTransform(points, predicted, cv::findHomography(points, pixels));
  double sum = 0.0;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    sum += (pixels[k] - predicted[k]).dot(pixels[k] - predicted[k]);
  }
  return std::sqrt(sum / static_cast<double>(pixels.size()));
}

TEST(Charuco, AllCornersOfASlantedBoardLieInItsPlane) {
  const auto pattern = ParseCharuco("7x5:0.04:0.03");
  ASSERT_TRUE(pattern.ok()) << pattern.status();
  const auto detector = CharucoDetector::Make(*pattern);
  ASSERT_TRUE(detector.ok()) << detector.status();
  const std::vector<CharucoCorner> corners = detector->Detect(Slanted(*pattern));
  ASSERT_EQ(corners.size(), 24);
  EXPECT_LT(MissedBy(corners), 0.1);
}

TEST(Charuco, OfABoardHalfCoveredTheRestIsFoundAndRightlyNamed) {
  const auto pattern = ParseCharuco("7x5:0.04:0.03:aruco_5x5_250");
  const auto detector = CharucoDetector::Make(*pattern);
  ASSERT_TRUE(detector.ok()) << detector.status();
  cv::Mat seen = Slanted(*pattern);
  const std::vector<CharucoCorner> whole = detector->Detect(seen);
  cv::rectangle(seen, cv::Rect(0, 0, 320, 480), cv::Scalar(90), cv::FILLED);
  const std::vector<CharucoCorner> rest = detector->Detect(seen);
  ASSERT_GE(rest.size(), 8);
  ASSERT_LT(rest.size(), whole.size());
  for (const CharucoCorner& corner : rest) {
    EXPECT_LT((corner.pixel - whole[static_cast<std::size_t>(corner.id)].pixel).norm(), 0.3);
  }
}

TEST(Charuco, ABoardOfAnotherFamilyIsNotSeen) {
  const auto detector = CharucoDetector::Make(*ParseCharuco("7x5:0.04:0.03:aruco_6x6_250"));
  EXPECT_TRUE(detector->Detect(Slanted(*ParseCharuco("7x5:0.04:0.03"))).empty());
  EXPECT_TRUE(detector->Detect(cv::Mat()).empty());
}

TEST(Charuco, WhatCannotBeIsRefusedWithTheRemedy) {
  for (const char* text :
       {"", "7x5", "7:0.04:0.03", "7x5:0.04", "7x2:0.04:0.03", "7x5:a:0.03", "7x5:0.04:0.03:a:b"}) {
    EXPECT_THAT(ParseCharuco(text).status().message(), HasSubstr("7x5:0.04:0.03")) << text;
  }
  EXPECT_THAT(ParseCharuco("7x5:0.03:0.04").status().message(), HasSubstr("less than that"));
  EXPECT_THAT(CharucoDetector::Make(*ParseCharuco("7x5:0.04:0.03:circles")).status().message(),
              AllOf(HasSubstr("circles"), HasSubstr("aruco_4x4_50")));
  EXPECT_THAT(CharucoDetector::Make(*ParseCharuco("20x20:0.04:0.03")).status().message(),
              HasSubstr("200 markers"));
}

}  // namespace
}  // namespace saccade::charuco_test
