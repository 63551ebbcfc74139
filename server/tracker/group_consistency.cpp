#include "server/tracker/group_consistency.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr double kFalse_px = 3.0;
constexpr double kTurnSigma_rad = 0.02;
constexpr double kNoise_px = 0.5;
constexpr double kCutoffs_px[] = {20.0, 12.0, 7.0, 5.0, 4.0};  // of the Tukey weight, one a round

}  // namespace

std::vector<bool> AgreeTogether(std::span<const GroupResidual> matches,
                                const Eigen::Matrix<double, 6, 1>& camera_sigma) {
  std::vector<bool> agrees(matches.size(), true);
  int groups = 0;
  for (const GroupResidual& each : matches) groups = std::max(groups, each.group + 1);
  const int size = 6 + 3 * groups;
  Eigen::VectorXd prior(size);
  prior.head<6>() = camera_sigma.cwiseMax(1e-4).cwiseAbs2().cwiseInverse();
  prior.tail(3 * groups).setConstant(1.0 / (kTurnSigma_rad * kTurnSigma_rad));
  std::vector<double> off;
  for (const GroupResidual& each : matches) off.push_back(each.residual.norm());
  for (const double cutoff : kCutoffs_px) {
    Eigen::MatrixXd normal = prior.asDiagonal();
    Eigen::VectorXd pulled = Eigen::VectorXd::Zero(size);
    Eigen::Matrix<double, 2, 9> rows;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      if (off[k] >= cutoff) continue;
      const double inside = 1.0 - (off[k] / cutoff) * (off[k] / cutoff);
      const double weight = inside * inside / (kNoise_px * kNoise_px);
      const int at = 6 + 3 * matches[k].group;
      rows << matches[k].d_camera, matches[k].d_turn;
      const Eigen::Matrix<double, 9, 9> squared = weight * rows.transpose() * rows;
      const Eigen::Matrix<double, 9, 1> pull = weight * rows.transpose() * matches[k].residual;
      normal.topLeftCorner<6, 6>() += squared.topLeftCorner<6, 6>();
      normal.block<6, 3>(0, at) += squared.topRightCorner<6, 3>();
      normal.block<3, 6>(at, 0) += squared.bottomLeftCorner<3, 6>();
      normal.block<3, 3>(at, at) += squared.bottomRightCorner<3, 3>();
      pulled.head<6>() += pull.head<6>();
      pulled.segment<3>(at) += pull.tail<3>();
    }
    const Eigen::VectorXd fit = normal.ldlt().solve(pulled);
    for (std::size_t k = 0; k < matches.size(); ++k) {
      off[k] = (matches[k].residual - matches[k].d_camera * fit.head<6>() -
                matches[k].d_turn * fit.segment<3>(6 + 3 * matches[k].group))
                   .norm();
    }
  }
  const auto good = std::count_if(off.begin(), off.end(), [](double o) { return o < kFalse_px; });
  if (2 * good <= std::ssize(matches)) return agrees;
  for (std::size_t k = 0; k < matches.size(); ++k) agrees[k] = off[k] < kFalse_px;
  return agrees;
}

}  // namespace saccade
