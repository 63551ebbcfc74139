#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>

namespace saccade {

/// A picture at full, half and quarter resolution, prepared once a frame.
///
/// Level k + 1 is the mean of 2 x 2 pixels of level k (an odd last row or column is dropped), so
/// the centre of pixel (x, y) of level k lies at level-0 pixel ((x + 0.5) * 2^k - 0.5, ...).
/// Buffers are reused: building the next frame of the same size allocates nothing. Level 0 shares
/// the caller's pixels, which must stay unchanged for as long as the pyramid is read.
class ImagePyramid {
 public:
  static constexpr int kLevels = 3;

  /// `grey`: CV_8UC1, at least 64 x 64. InvalidArgument otherwise; the pyramid is then empty.
  absl::Status Build(const cv::Mat& grey);

  bool empty() const { return levels_[0].empty(); }
  const cv::Mat& level(int k) const { return levels_[k]; }
  int width() const { return levels_[0].cols; }
  int height() const { return levels_[0].rows; }

  static Eigen::Vector2d ToLevel(const Eigen::Vector2d& pixel, int k) {
    return (pixel.array() + 0.5).matrix() / (1 << k) - Eigen::Vector2d(0.5, 0.5);
  }
  static Eigen::Vector2d FromLevel(const Eigen::Vector2d& pixel, int k) {
    return (pixel.array() + 0.5).matrix() * (1 << k) - Eigen::Vector2d(0.5, 0.5);
  }

 private:
  std::array<cv::Mat, kLevels> levels_;
};

}  // namespace saccade
