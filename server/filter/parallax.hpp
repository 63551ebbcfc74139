#pragma once

#include <Eigen/Dense>
#include <span>

namespace saccade {

/// One match against what a camera that only turned since the feature's birth would have seen.
struct TurnResidual {
  Eigen::Vector2d residual;                // measured - pixel of the bearing at infinity [px]
  Eigen::Matrix<double, 2, 3> d_rotation;  // d pixel / d camera rotation (local) [px/rad]
  Eigen::Matrix2d noise;                   // R [px^2]
};

/// What one rotation cannot explain of the matches of one pose clone.
struct TurnMisfit {
  double squared = 0.0;  // residuals after the fit, squared and weighted: chi2 if there is none
  double freedom = 0.0;  // its degrees of freedom

  /// How surely there is parallax, where the matches' covariance is `noise_scale` R: 0 up to the
  /// mean of chi2 and `sigmas` standard deviations, 1 from three times that.
  double Evidence(double sigmas, double noise_scale) const;
};

/// Fits a rotation (least squares, one step). With fewer than 3 matches the present one stands.
TurnMisfit FitTurn(std::span<const TurnResidual> matches);

}  // namespace saccade
