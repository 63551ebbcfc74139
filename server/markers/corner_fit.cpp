#include "server/markers/corner_fit.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "server/markers/border_fit.hpp"

namespace saccade {
namespace {

constexpr int kIterations = 40;
constexpr double kConverged_px = 0.003;
// What a lens file, a printer and a pixel's own shape leave of the best corner [px^2].
constexpr double kLeastCornerVariance_px2 = 0.04 * 0.04;
// Of a pixel's grey value, with what sampling between pixels adds.
constexpr double kNoise = 4.0;
// A corner of line fits that could not be looked at more closely.
constexpr double kUnrefinedVariance_px2 = 0.3 * 0.3;
// Lines beside a square that was found, and how far they may move its corners.
constexpr double kLinesReach_px = 2, kWideReachOfSide = 0.08;
constexpr double kMostMoved_px = 3, kMostMovedOfSide = 0.1;
// Where there are none: something covers a side, and the corner may be anywhere.
constexpr double kUnknownOfSide = 0.04;
constexpr int kLeastReach_px = 2, kMostReach_px = 5;
constexpr double kReachOfSide = 0.12;  // the border of a tag with eight cells is an eighth wide
constexpr int kRingPoints = 32;
constexpr double kLeastContrast = 20;

/// Grey value between pixels.
double GreyAt(const cv::Mat& grey, double x, double y) {
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const double a = x - left, b = y - top;
  const auto* upper = grey.ptr<std::uint8_t>(top) + left;
  const auto* lower = grey.ptr<std::uint8_t>(top + 1) + left;
  return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
}

bool Inside(const cv::Mat& grey, const Eigen::Vector2d& pixel, double margin) {
  return pixel.x() >= margin && pixel.y() >= margin && pixel.x() < grey.cols - 1 - margin &&
         pixel.y() < grey.rows - 1 - margin;
}

/// Variance of the corner along its worst axis, from the gradients around it and the noise.
std::optional<double> VarianceAt(const cv::Mat& grey, const Eigen::Vector2d& pixel, int reach) {
  Eigen::Matrix2d tensor = Eigen::Matrix2d::Zero();
  const double width = 0.5 * reach;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const double x = pixel.x() + dx, y = pixel.y() + dy;
      const Eigen::Vector2d gradient(0.5 * (GreyAt(grey, x + 1, y) - GreyAt(grey, x - 1, y)),
                                     0.5 * (GreyAt(grey, x, y + 1) - GreyAt(grey, x, y - 1)));
      tensor +=
          std::exp(-(dx * dx + dy * dy) / (2 * width * width)) * gradient * gradient.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(tensor);
  if (!(axes.eigenvalues()[0] > 1.0)) return std::nullopt;
  return kLeastCornerVariance_px2 + kNoise * kNoise / axes.eigenvalues()[0];
}

}  // namespace

int CornerReach(double side_px) {
  return std::clamp(static_cast<int>(kReachOfSide * side_px), kLeastReach_px, kMostReach_px);
}

std::optional<CornerFit> FitCorner(const cv::Mat& grey, const Eigen::Vector2d& start,
                                   int reach_px) {
  if (!start.allFinite() || !Inside(grey, start, reach_px + 2)) return std::nullopt;
  std::vector<cv::Point2f> corner = {cv::Point2f(cv::Point2d(start.x(), start.y()))};
  cv::cornerSubPix(grey, corner, {reach_px, reach_px}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, kIterations,
                                    kConverged_px));
  CornerFit fit{Eigen::Vector2d(corner[0].x, corner[0].y), 0};
  if ((fit.pixel - start).norm() > reach_px || !Inside(grey, fit.pixel, reach_px + 2)) {
    return std::nullopt;
  }
  const std::optional<double> variance = VarianceAt(grey, fit.pixel, reach_px);
  if (!variance) return std::nullopt;
  fit.variance_px2 = *variance;
  return fit;
}

bool IsSaddle(const cv::Mat& grey, const Eigen::Vector2d& pixel, double radius_px) {
  if (!Inside(grey, pixel, radius_px + 1)) return false;
  std::array<double, kRingPoints> ring;
  for (int k = 0; k < kRingPoints; ++k) {
    const double angle = 2 * std::numbers::pi * k / kRingPoints;
    ring[k] = GreyAt(grey, pixel.x() + radius_px * std::cos(angle),
                     pixel.y() + radius_px * std::sin(angle));
  }
  const auto [low, high] = std::minmax_element(ring.begin(), ring.end());
  if (*high - *low < kLeastContrast) return false;
  const double middle = 0.5 * (*low + *high);
  int changes = 0;
  for (int k = 0; k < kRingPoints; ++k) {
    changes += (ring[k] > middle) != (ring[(k + 1) % kRingPoints] > middle);
  }
  return changes == 4;
}

void RefineCorners(const cv::Mat& grey, double least_side_px, double kept_variance_px2,
                   MarkerSighting& sighting) {
  const double side = ShortestSide(sighting);
  const int reach = CornerReach(side);
  std::array<bool, 4> lone{};
  const std::array<Eigen::Vector2d, 4> given = sighting.corners;
  for (int k = 0; k < 4; ++k) {
    lone[k] = true;
    sighting.variance_px2[k] = std::max(kept_variance_px2, kUnrefinedVariance_px2);
    const std::optional<CornerFit> fit = FitCorner(grey, given[k], reach);
    if (!fit) continue;
    sighting.variance_px2[k] = std::max(kept_variance_px2, fit->variance_px2);
    if (!IsSaddle(grey, fit->pixel, reach)) continue;
    lone[k] = false;
    sighting.corners[k] = fit->pixel;
    sighting.variance_px2[k] = fit->variance_px2;
  }
  if (side < least_side_px || std::none_of(lone.begin(), lone.end(), std::identity())) return;
  BorderFitOptions options;
  options.reach_px = kLinesReach_px;
  std::optional<BorderFit> lines = FitBorder(grey, given, options);
  if (!lines) {
    options.reach_px = std::max(kLinesReach_px, kWideReachOfSide * side);
    lines = FitBorder(grey, given, options);
  }
  for (int k = 0; k < 4; ++k) {
    if (!lone[k]) continue;
    if (!lines || (lines->corners[k] - given[k]).norm() > kMostMoved_px + kMostMovedOfSide * side) {
      sighting.variance_px2[k] += std::pow(kUnknownOfSide * side, 2);
      continue;
    }
    sighting.corners[k] = lines->corners[k];
    sighting.variance_px2[k] = lines->variance_px2[k];
  }
}

}  // namespace saccade
