#include "server/eval/score.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <numbers>

namespace saccade {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr Timestamp kSecond_ns = 1'000'000'000;

Vector3d Mean(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

struct Errors {
  double position_m = 0, rotation_rad = 0;  // root mean squares
};

Errors AbsoluteErrors(const std::vector<PosePair>& pairs, const Similarity& truth_from_estimate) {
  double position = 0, rotation = 0;
  for (const PosePair& pair : pairs) {
    position +=
        (truth_from_estimate * pair.estimate.translation - pair.truth.translation).squaredNorm();
    const Eigen::Quaterniond turned =
        truth_from_estimate.target_from_source.rotation * pair.estimate.rotation;
    rotation += LogQuaternion(turned.conjugate() * pair.truth.rotation).squaredNorm();
  }
  const auto count = static_cast<double>(pairs.size());
  return {std::sqrt(position / count), std::sqrt(rotation / count)};
}

/// Median interval of the pairs' times.
Timestamp PairInterval(const std::vector<PosePair>& pairs) {
  Trajectory times;
  for (const PosePair& pair : pairs) times.push_back({pair.time_ns, {}});
  return MedianInterval(times);
}

void AddRelativeErrors(const std::vector<PosePair>& pairs, double scale, TrajectoryScore& score) {
  const Timestamp tolerance = PairInterval(pairs) / 2;
  double position = 0, rotation = 0;
  std::size_t count = 0, j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Timestamp wanted = pairs[i].time_ns + kSecond_ns;
    while (j + 1 < pairs.size() &&
           std::abs(pairs[j + 1].time_ns - wanted) <= std::abs(pairs[j].time_ns - wanted)) {
      ++j;
    }
    if (std::abs(pairs[j].time_ns - wanted) > tolerance) continue;
    Rigid3 estimate = pairs[i].estimate.Inverse() * pairs[j].estimate;
    estimate.translation *= scale;
    const Rigid3 error = (pairs[i].truth.Inverse() * pairs[j].truth).Inverse() * estimate;
    position += error.translation.squaredNorm();
    rotation += LogQuaternion(error.rotation).squaredNorm();
    ++count;
  }
  if (count == 0) return;
  score.rpe_1s_m = std::sqrt(position / static_cast<double>(count));
  score.rpe_1s_deg = std::sqrt(rotation / static_cast<double>(count)) * kDegrees;
}

}  // namespace

Similarity AlignMoments(const AlignmentMoments& moments, TrajectoryAlignment alignment) {
  const Eigen::JacobiSVD<Matrix3d> svd(moments.covariance,
                                       Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs = Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs.z() = -1;
  const Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  Similarity result;
  if (alignment == TrajectoryAlignment::kSim3 && moments.source_variance > 1e-20) {
    result.scale = svd.singularValues().dot(signs) / moments.source_variance;
  }
  result.target_from_source.rotation = Eigen::Quaterniond(rotation).normalized();
  result.target_from_source.translation =
      moments.target_mean - result.scale * (rotation * moments.source_mean);
  return result;
}

Similarity AlignPoints(const std::vector<Vector3d>& source, const std::vector<Vector3d>& target,
                       TrajectoryAlignment alignment) {
  AlignmentMoments moments = {Mean(source), Mean(target), Matrix3d::Zero(), 0};
  const double part = 1.0 / static_cast<double>(source.size());
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vector3d from_mean = source[i] - moments.source_mean;
    moments.covariance += part * (target[i] - moments.target_mean) * from_mean.transpose();
    moments.source_variance += part * from_mean.squaredNorm();
  }
  return AlignMoments(moments, alignment);
}

std::vector<PosePair> Associate(const Trajectory& estimate, const Trajectory& truth,
                                Timestamp frame_interval_ns) {
  Timestamp interval = frame_interval_ns > 0 ? frame_interval_ns : MedianInterval(estimate);
  if (interval == 0) interval = MedianInterval(truth);
  std::vector<PosePair> pairs;
  for (const StampedPose& pose : estimate) {
    // A tenth more than an interval, for time stamps that jitter.
    const auto at = PoseAt(truth, pose.time_ns, interval + interval / 10, interval / 2);
    if (at) pairs.push_back({pose.time_ns, pose.world_from_camera, *at});
  }
  return pairs;
}

absl::StatusOr<TrajectoryScore> Score(const std::vector<PosePair>& pairs,
                                      TrajectoryAlignment alignment) {
  if (pairs.size() < 3) {
    return absl::FailedPreconditionError(
        absl::StrCat("only ", pairs.size(),
                     " poses have a true pose at their time; three are needed. Check that both "
                     "files use the same clock"));
  }
  std::vector<Vector3d> estimate, truth;
  for (const PosePair& pair : pairs) {
    estimate.push_back(pair.estimate.translation);
    truth.push_back(pair.truth.translation);
  }
  TrajectoryScore score;
  score.pairs = pairs.size();
  const Errors se3 = AbsoluteErrors(pairs, AlignPoints(estimate, truth, TrajectoryAlignment::kSe3));
  const Similarity sim3 = AlignPoints(estimate, truth, TrajectoryAlignment::kSim3);
  const Errors similar = AbsoluteErrors(pairs, sim3);
  score.ate_se3_m = se3.position_m;
  score.rotation_se3_deg = se3.rotation_rad * kDegrees;
  score.ate_sim3_m = similar.position_m;
  score.rotation_sim3_deg = similar.rotation_rad * kDegrees;
  score.scale = sim3.scale;
  const Vector3d still = Mean(truth);
  double squares = 0;
  for (const Vector3d& point : truth) squares += (point - still).squaredNorm();
  score.ate_null_m = std::sqrt(squares / static_cast<double>(truth.size()));
  AddRelativeErrors(pairs, alignment == TrajectoryAlignment::kSim3 ? sim3.scale : 1.0, score);
  return score;
}

}  // namespace saccade
