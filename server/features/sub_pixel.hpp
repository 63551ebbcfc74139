#pragma once

#include <Eigen/Dense>
#include <opencv2/core.hpp>

#include "server/features/patch.hpp"

namespace saccade {

/// How a template sits on a picture, to a fraction of a pixel.
struct Alignment {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // where the template's centre lies
  bool converged = false;
  /// Covariance of `pixel` [px^2] that the residual and the template's gradients explain; not
  /// usable (infinite) for a template without gradients in some direction.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  double gain = 1.0;      // picture contrast / template contrast
  double residual = 0.0;  // RMS [grey levels]
};

/// Aligns `templ` with `image` from `start` by Lucas-Kanade with gain and offset.
///
/// At every step the picture around the current place is expressed by the template, its gradients
/// and a constant (a linear fit with fixed normal equations); the gradients' share is the shift.
/// Converged: last step below 0.02 px and within 1.5 px of `start`. Otherwise `pixel` is `start`,
/// and the covariance is of the fit there.
Alignment AlignTemplate(const cv::Mat& image, const CorrelationTemplate& templ,
                        const Eigen::Vector2d& start, int max_iterations);

}  // namespace saccade
