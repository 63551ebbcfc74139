#pragma once

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

namespace saccade {

/// Lines along the four sides of a dark square on bright ground, and where they meet.
struct BorderFit {
  std::array<Eigen::Vector2d, 4> corners;  // in the order that was given [px]
  /// Of each corner along an axis: half the trace of its covariance, from both lines' [px^2].
  std::array<double, 4> variance_px2{};
  double support = 0;  // share of the samples that agree, of the side with the fewest
};

struct BorderFitOptions {
  double reach_px = 3;         // how far beside the given sides theirs are looked for
  double least_support = 0.5;  // of every side; the rest may be covered
  double least_contrast = 15;  // grey levels across a side
};

/// Fits lines to the dark-to-bright edges beside the sides of the quadrilateral `rough` [px], whose
/// corners go round either way: 1-D searches with a derivative of Gaussian, robust lines with
/// covariance, corners with S = sum J_i S_i J_i^T (Koller et al., VRST 1997, section 4.2). Nothing
/// if a side is not there, or leaves the picture.
std::optional<BorderFit> FitBorder(const cv::Mat& grey, const std::array<Eigen::Vector2d, 4>& rough,
                                   const BorderFitOptions& options = {});

}  // namespace saccade
