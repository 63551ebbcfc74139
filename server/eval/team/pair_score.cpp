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

namespace {

constexpr double kSeam_m = 0.5, kSeam_rad = 0.5236;

/// The pose that was taken from nearest, by truth; null: none from near.
const PosePair* Nearest(const std::vector<PosePair>& pairs, const Rigid3& truth) {
  const PosePair* nearest = nullptr;
  double least = kSeam_m + kSeam_rad;
  for (const PosePair& pair : pairs) {
    const double apart_m = (pair.truth.translation - truth.translation).norm();
    const double apart_rad = RotationAngle(pair.truth, truth);
    if (apart_m > kSeam_m || apart_rad > kSeam_rad || apart_m + apart_rad > least) continue;
    least = apart_m + apart_rad;
    nearest = &pair;
  }
  return nearest;
}

void ScoreSeam(const std::vector<PosePair>& carrier, const std::vector<PosePair>& carried,
               const Similarity3& carrier_from_carried, double metres, MergeError& error) {
  double squared_m = 0, squared_rad = 0;
  for (const PosePair& pair : carried) {
    const PosePair* near = Nearest(carrier, pair.truth);
    if (near == nullptr) continue;
    const Rigid3 found = near->estimate.Inverse() * carrier_from_carried.Move(pair.estimate);
    const Rigid3 truth = near->truth.Inverse() * pair.truth;
    squared_m += (metres * found.translation - truth.translation).squaredNorm();
    squared_rad += std::pow(RotationAngle(found, truth), 2);
    ++error.seam_poses;
  }
  if (error.seam_poses == 0) return;
  const double n = static_cast<double>(error.seam_poses);
  error.seam_m = std::sqrt(squared_m / n);
  error.seam_deg = std::sqrt(squared_rad / n) * 180.0 / std::numbers::pi;
}

}  // namespace

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
  ScoreSeam(carrier, carried, carrier_from_carried, truth_from_carrier.scale, error);
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
