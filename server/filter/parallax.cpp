#include "server/filter/parallax.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace saccade {

double TurnMisfit::Evidence(double sigmas, double noise_scale) const {
  constexpr double kSurely = 3.0;
  if (freedom <= 0.0) return 0.0;
  const double chance = noise_scale * (freedom + sigmas * std::sqrt(2.0 * freedom));
  return std::clamp((squared / chance - 1.0) / (kSurely - 1.0), 0.0, 1.0);
}

TurnMisfit FitTurn(std::span<const TurnResidual> matches) {
  constexpr std::size_t kFewestToFit = 3;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pulled = Eigen::Vector3d::Zero();
  double squared = 0.0;
  for (const TurnResidual& match : matches) {
    const Eigen::Matrix2d weight = match.noise.inverse();
    const Eigen::Matrix<double, 3, 2> side = match.d_rotation.transpose() * weight;
    normal += side * match.d_rotation;
    pulled += side * match.residual;
    squared += match.residual.dot(weight * match.residual);
  }
  double freedom = 2.0 * static_cast<double>(matches.size());
  if (matches.size() >= kFewestToFit) {
    const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
    if (factor.info() == Eigen::Success && factor.isPositive()) {
      squared -= pulled.dot(factor.solve(pulled));
      freedom -= 3.0;
    }
  }
  return {squared, freedom};
}

}  // namespace saccade
