#include "server/features/corner_detector.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

namespace saccade::corner_detector_test {
namespace {

/// Bright squares of 24 px on dark, 48 px apart: corners at known places.
cv::Mat Squares(int width = 640, int height = 480) {
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(40));
  for (int y = 36; y + 24 < height; y += 48) {
    for (int x = 36; x + 24 < width; x += 48) image(cv::Rect(x, y, 24, 24)) = 200;
  }
  return image;
}

/// Min eigenvalue of the definition, straight from slam-spec 5.1.
double Score(const cv::Mat& image, int x, int y, int window) {
  double xx = 0, xy = 0, yy = 0;
  for (int v = y - window / 2; v <= y + window / 2; ++v) {
    for (int u = x - window / 2; u <= x + window / 2; ++u) {
      const double gx = (image.at<std::uint8_t>(v, u + 1) - image.at<std::uint8_t>(v, u - 1)) / 2.0;
      const double gy = (image.at<std::uint8_t>(v + 1, u) - image.at<std::uint8_t>(v - 1, u)) / 2.0;
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  return (xx + yy) / 2 - std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
}

class CornerTest : public ::testing::Test {
 protected:
  void Use(const cv::Mat& image) {
    image_ = image;
    ASSERT_TRUE(pyramid_.Build(image_).ok());
  }
  cv::Mat image_;
  ImagePyramid pyramid_;
  std::vector<Corner> corners_;
};

TEST_F(CornerTest, ScoreIsTheSpecifiedOneAndTheBestOfItsCell) {
  cv::Mat noise(480, 640, CV_8UC1);
  cv::RNG(7).fill(noise, cv::RNG::UNIFORM, 0, 256);
  Use(noise);
  CornerDetector detector({.min_score = 1, .cell_px = 32});
  detector.DetectAll(pyramid_, {}, 1000, corners_);
  ASSERT_GT(corners_.size(), 100U);
  for (std::size_t k = 0; k < corners_.size(); k += 20) {
    const int x = static_cast<int>(std::lround(corners_[k].pixel.x()));
    const int y = static_cast<int>(std::lround(corners_[k].pixel.y()));
    // The parabola moves less than half a pixel, so rounding finds the pixel again (or a tie).
    EXPECT_NEAR(corners_[k].score, Score(noise, x, y, 11), 0.02 * corners_[k].score);
  }
  EXPECT_TRUE(std::is_sorted(corners_.begin(), corners_.end(),
                             [](const Corner& a, const Corner& b) { return a.score > b.score; }));
}

TEST_F(CornerTest, FindsTheCornersOfSquaresOnBothLevels) {
  Use(Squares());
  for (const int level : {0, 1}) {
    CornerDetector detector({.cell_px = 24, .min_distance_px = 10, .level = level});
    detector.DetectAll(pyramid_, {}, 1000, corners_);
    EXPECT_GT(corners_.size(), 300U) << level;
    int exact = 0;
    for (const Corner& corner : corners_) {
      // Edges lie at 36 + 48 k - 0.5 and 60 + 48 k - 0.5. The score is greatest where the window
      // holds most of both edges: half a window inside the square's corner.
      const auto from_edge = [](double c) {
        const double r = std::fmod(c + 0.5 - 36 + 480, 24.0);
        return std::min(r, 24.0 - r);
      };
      exact += from_edge(corner.pixel.x()) < 6.6 && from_edge(corner.pixel.y()) < 6.6;
    }
    EXPECT_GT(exact, 0.9 * static_cast<double>(corners_.size())) << level;
  }
}

TEST_F(CornerTest, KeepsAwayFromBorderOccupiedPixelsAndOtherCorners) {
  Use(Squares());
  CornerDetector detector({.cell_px = 24, .min_distance_px = 15});
  detector.DetectAll(pyramid_, {}, 1000, corners_);
  std::vector<Eigen::Vector2d> occupied;
  for (std::size_t k = 0; k < corners_.size(); k += 2) occupied.push_back(corners_[k].pixel);
  occupied.emplace_back(std::numeric_limits<double>::quiet_NaN(), 3.0);
  occupied.emplace_back(1e12, -1e12);
  std::vector<Corner> more;
  detector.DetectAll(pyramid_, occupied, 1000, more);
  ASSERT_GT(more.size(), 50U);
  for (const Corner& corner : more) {
    EXPECT_TRUE(cv::Rect2d(19.5, 19.5, 600, 440).contains({corner.pixel.x(), corner.pixel.y()}));
    for (const Eigen::Vector2d& other : occupied) {
      if (!other.allFinite()) continue;
      EXPECT_GT((corner.pixel - other).norm(), 14.2);
    }
    for (const Corner& other : more) {
      if (&other == &corner) continue;
      EXPECT_GE((corner.pixel - other.pixel).norm(), 15.0);
    }
  }
}

TEST_F(CornerTest, BandsTogetherCoverThePicture) {
  Use(Squares());
  CornerDetector detector({.cell_px = 24, .band_cells = 3});
  std::vector<Corner> all;
  detector.DetectAll(pyramid_, {}, 1000, all);
  int found = 0, rows = 0;
  std::vector<Eigen::Vector2d> seen;
  while (rows < 480) {
    const cv::Rect band = detector.DetectNextBand(pyramid_, seen, 1000, corners_);
    for (const Corner& corner : corners_) {
      EXPECT_GE(corner.pixel.y(), band.y - 1);
      EXPECT_LE(corner.pixel.y(), band.y + band.height);
      seen.push_back(corner.pixel);
    }
    found += static_cast<int>(corners_.size());
    rows += band.height;
  }
  EXPECT_NEAR(found, static_cast<int>(all.size()), 0.1 * static_cast<double>(all.size()));
}

TEST_F(CornerTest, EmptiestBandIsChosenAndNoBandStarves) {
  Use(Squares());
  CornerDetector detector({.cell_px = 32, .band_cells = 3});  // 5 bands
  std::vector<Eigen::Vector2d> occupied;
  for (int x = 30; x < 610; x += 20) {
    for (int y = 100; y < 460; y += 20) occupied.emplace_back(x, y);
  }
  EXPECT_EQ(detector.DetectEmptiestBand(pyramid_, occupied, 10, corners_).y, 0);
  std::set<int> tops = {0};
  for (int k = 0; k < 8; ++k) {
    tops.insert(detector.DetectEmptiestBand(pyramid_, occupied, 10, corners_).y);
  }
  EXPECT_GE(tops.size(), 3U);
}

TEST_F(CornerTest, BlankEdgeAndTinyPicturesGiveNothing) {
  CornerDetector detector({});
  detector.DetectAll(ImagePyramid(), {}, 10, corners_);
  EXPECT_TRUE(corners_.empty());
  Use(cv::Mat(480, 640, CV_8UC1, cv::Scalar(77)));
  detector.DetectAll(pyramid_, {}, 10, corners_);
  EXPECT_TRUE(corners_.empty());
  cv::Mat edge(480, 640, CV_8UC1, cv::Scalar(20));
  edge.colRange(320, 640) = 220;
  Use(edge);
  detector.DetectAll(pyramid_, {}, 10, corners_);
  EXPECT_TRUE(corners_.empty()) << corners_.size();
  EXPECT_FALSE(pyramid_.Build(cv::Mat(20, 20, CV_8UC1)).ok());
  EXPECT_FALSE(pyramid_.Build(cv::Mat(480, 640, CV_8UC3)).ok());
  EXPECT_TRUE(pyramid_.empty());
}

TEST(CornerOptions, ValidateNamesTheField) {
  EXPECT_TRUE(CornerOptions{}.Validate().ok());
  EXPECT_NE(CornerOptions{.window_px = 10}.Validate().message().find("window_px"),
            std::string::npos);
  EXPECT_NE(CornerOptions{.level = 2}.Validate().message().find("level"), std::string::npos);
}

}  // namespace
}  // namespace saccade::corner_detector_test
