#pragma once

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>

namespace saccade {

/// Colours of a picture by their place in a square that is seen at a slant: (0, 0) is the first of
/// its corners, (1, 0) the next clockwise, (1, 1) the one after that. Keeps no copy of the picture.
class SquareSampler {
 public:
  /// `color`: CV_8UC3, BGR. `corners`: clockwise as seen [px].
  SquareSampler(const cv::Mat& color, const std::array<Eigen::Vector2d, 4>& corners);

  /// Blue, green, red between pixels; beyond the picture's edge what is there.
  Eigen::Vector3d At(double u, double v) const;
  double side_px() const { return side_px_; }  // the shortest

 private:
  const cv::Mat& color_;
  Eigen::Matrix3d place_;
  double side_px_ = 0;
};

/// By how much red is above blue and green [grey levels].
inline double Redness(const Eigen::Vector3d& blue_green_red) {
  return blue_green_red[2] - blue_green_red.head<2>().maxCoeff();
}

}  // namespace saccade
