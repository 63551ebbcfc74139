#include "server/markers/square_sampler.hpp"

#include <algorithm>

namespace saccade {
namespace {

using Point = Eigen::Vector2d;

/// From the unit square, clockwise from (0, 0), to the corners.
Eigen::Matrix3d HomographyTo(const std::array<Point, 4>& corners) {
  const Point sum = corners[0] - corners[1] + corners[2] - corners[3];
  const Point a = corners[1] - corners[2], b = corners[3] - corners[2];
  const double scale = a.x() * b.y() - b.x() * a.y();
  const double g = (sum.x() * b.y() - b.x() * sum.y()) / scale;
  const double h = (a.x() * sum.y() - sum.x() * a.y()) / scale;
  Eigen::Matrix3d matrix;
  matrix.col(0) << corners[1] * (1 + g) - corners[0], g;
  matrix.col(1) << corners[3] * (1 + h) - corners[0], h;
  matrix.col(2) << corners[0], 1;
  return matrix;
}

}  // namespace

SquareSampler::SquareSampler(const cv::Mat& color, const std::array<Point, 4>& corners)
    : color_(color), place_(HomographyTo(corners)) {
  side_px_ = (corners[3] - corners[0]).norm();
  for (int k = 0; k < 3; ++k) {
    side_px_ = std::min(side_px_, (corners[k + 1] - corners[k]).norm());
  }
}

Eigen::Vector3d SquareSampler::At(double u, double v) const {
  const Point p = (place_ * Eigen::Vector3d(u, v, 1)).hnormalized();
  const double x = std::clamp(p.x(), 0.0, color_.cols - 1.001);
  const double y = std::clamp(p.y(), 0.0, color_.rows - 1.001);
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const double a = x - left, b = y - top;
  const auto value = [&](int row, int column) {
    const auto& pixel = color_.at<cv::Vec3b>(row, column);
    return Eigen::Vector3d(pixel[0], pixel[1], pixel[2]);
  };
  return (1 - b) * ((1 - a) * value(top, left) + a * value(top, left + 1)) +
         b * ((1 - a) * value(top + 1, left) + a * value(top + 1, left + 1));
}

}  // namespace saccade
