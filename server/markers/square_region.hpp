#pragma once

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace saccade {

/// A dark region and the four sides it is bounded by.
struct SquareRegion {
  std::array<Eigen::Vector2d, 4> corners;  // clockwise as seen; to a pixel or two
  double fill = 0;                         // its area over the quadrilateral's
};

/// Grows regions in the green channel, where red and black are one.
class RegionGrower {
 public:
  /// `green` and `redness` (red above the other channels), CV_8UC1, must outlive it.
  RegionGrower(const cv::Mat& green, const cv::Mat& redness);

  /// What is connected with `seed` and below `threshold`, if it is such as a square with red cells
  /// can be: not cut by the picture's edge, not nearly all of it, partly red, nearly as large
  /// as four straight sides about it. A region that was refused or given before is not again.
  std::optional<SquareRegion> Grow(cv::Point seed, int threshold);

 private:
  struct Grown {
    int threshold = 0;
    bool refused = true;  // as it is too large or cut: so is all that holds it
    int area = 0, red = 0, top = 0;
    std::vector<std::array<int, 2>> rows;  // leftmost and rightmost pixel, from `top`
  };
  bool SeenBefore(cv::Point seed, int threshold) const;
  Grown Flood(cv::Point seed, int threshold);

  const cv::Mat& green_;
  const cv::Mat& redness_;
  cv::Mat labels_;  // CV_32SC1: index of the last region there, -1 for none
  std::vector<Grown> regions_;
};

/// The least quadrilateral about convex `hull` whose sides lie on sides of its, so that a corner
/// that is covered is put back; clockwise as seen. Nothing for what has no four sides.
std::optional<std::array<Eigen::Vector2d, 4>> FourSidesAbout(const std::vector<cv::Point>& points);

}  // namespace saccade
