#include "server/eval/team/pair_score.hpp"

#include <cmath>
#include <numbers>

namespace saccade {

Similarity3 AlignPoses(const std::vector<PosePair>& pairs) {
  const double n = static_cast<double>(pairs.size());
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    const Eigen::Vector4d turn =
        (pair.truth.rotation * pair.estimate.rotation.conjugate()).coeffs();
    sum += turn.dot(sum) < 0 ? -turn : turn;
    from += pair.estimate.translation / n;
    to += pair.truth.translation / n;
  }
  Similarity3 aligned;
  aligned.rotation = Eigen::Quaterniond(sum.normalized());
  double both = 0.0, squared = 0.0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d turned = aligned.rotation * (pair.estimate.translation - from);
    both += turned.dot(pair.truth.translation - to);
    squared += turned.squaredNorm();
  }
  if (both > 0.0) aligned.scale = both / squared;
  aligned.translation = to - aligned.scale * (aligned.rotation * from);
  return aligned;
}

std::optional<MergeError> ScoreMerge(const std::vector<PosePair>& carrier,
                                     const std::vector<PosePair>& carried,
                                     const Similarity3& carrier_from_carried,
                                     const Matrix7d& covariance) {
  if (carrier.size() < 3 || carried.size() < 3) return std::nullopt;
  const Similarity3 truth_from_carrier = AlignPoses(carrier);
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
  error.sigma_m = truth_from_carrier.scale * std::sqrt((by * covariance * by.transpose()).trace());
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
