#include "server/anchors/rigid_fit.hpp"

namespace saccade {

Rigid3 FitRigid(std::span<const WeightedPair> pairs) {
  double total = 0;
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero();
  for (const WeightedPair& pair : pairs) {
    total += pair.weight;
    source_mean += pair.weight * pair.source;
    target_mean += pair.weight * pair.target;
  }
  source_mean /= total;
  target_mean /= total;
  const Rigid3 translation_only{Eigen::Quaterniond::Identity(), target_mean - source_mean};
  if (pairs.size() < 3) return translation_only;

  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();    // target x source
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // source x source
  for (const WeightedPair& pair : pairs) {
    const Eigen::Vector3d s = pair.source - source_mean;
    cross += pair.weight / total * (pair.target - target_mean) * s.transpose();
    scatter += pair.weight / total * s * s.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(scatter, Eigen::EigenvaluesOnly);
  if (!(spread.eigenvalues()(1) > 1e-2 * spread.eigenvalues()(2))) return translation_only;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) flip(2, 2) = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * flip * svd.matrixV().transpose();
  if (!rotation.allFinite()) return translation_only;
  const Eigen::Quaterniond q(rotation);
  return {q.normalized(), target_mean - q * source_mean};
}

}  // namespace saccade
