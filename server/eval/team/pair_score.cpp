#include "server/eval/team/pair_score.hpp"

#include <cmath>
#include <numbers>

namespace saccade {

std::optional<MergeError> ScoreMerge(const std::vector<PosePair>& carrier,
                                     const std::vector<PosePair>& carried,
                                     const Similarity3& carrier_from_carried,
                                     const Matrix7d& covariance) {
  if (carrier.size() < 3 || carried.size() < 3) return std::nullopt;
  std::vector<Eigen::Vector3d> estimated, true_points;
  for (const PosePair& pair : carrier) {
    estimated.push_back(pair.estimate.translation);
    true_points.push_back(pair.truth.translation);
  }
  const Similarity aligned = AlignPoints(estimated, true_points, Alignment::kSim3);
  const Similarity3 truth_from_carrier =
      Similarity3::FromRigid(aligned.target_from_source, aligned.scale);
  MergeError error;
  error.poses = carried.size();
  const double n = static_cast<double>(carried.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), turned = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PosePair& pair : carried) {
    const Rigid3 in_carrier = carrier_from_carried.Move(pair.estimate);
    const Rigid3 there = truth_from_carrier.Move(in_carrier);
    const Eigen::Vector3d off = there.translation - pair.truth.translation;
    const Eigen::Vector3d turn = LogQuaternion(there.rotation * pair.truth.rotation.conjugate());
    mean += off / n;
    turned += turn / n;
    middle += in_carrier.translation / n;
    error.rms_m += off.squaredNorm() / n;
    error.rms_deg += turn.squaredNorm() / n;
  }
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  error.off_m = mean.norm();
  error.off_deg = turned.norm() * kDegrees;
  error.rms_m = std::sqrt(error.rms_m);
  error.rms_deg = std::sqrt(error.rms_deg) * kDegrees;
  Eigen::Matrix<double, 3, 7> by;
  by << Eigen::Matrix3d::Identity(), -Skew(middle), middle;
  error.sigma_m = aligned.scale * std::sqrt((by * covariance * by.transpose()).trace());
  return error;
}

double TrueSpread(const std::vector<PosePair>& pairs) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    mean += pair.truth.translation / static_cast<double>(pairs.size());
  }
  double squared = 0;
  for (const PosePair& pair : pairs) squared += (pair.truth.translation - mean).squaredNorm();
  return std::sqrt(squared / std::max<double>(1.0, static_cast<double>(pairs.size())));
}

}  // namespace saccade
