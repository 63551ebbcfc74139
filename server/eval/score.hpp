#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "server/eval/trajectory.hpp"

namespace saccade {

enum class TrajectoryAlignment { kSe3, kSim3 };

/// target = scale * rotation * source + translation.
struct Similarity {
  double scale = 1.0;
  Rigid3 target_from_source;

  Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_source) const {
    return scale * (target_from_source.rotation * point_in_source) + target_from_source.translation;
  }
};

/// What an alignment needs to know of two point sets: means over the points, of covariance
/// (target - mean)(source - mean)^T and squared distance of the source from its mean.
struct AlignmentMoments {
  Eigen::Vector3d source_mean, target_mean;
  Eigen::Matrix3d covariance;
  double source_variance = 0;
};
Similarity AlignMoments(const AlignmentMoments& moments, TrajectoryAlignment alignment);

/// Least-squares alignment of point sets of the same size (at least one point).
/// Source: Umeyama, "Least-squares estimation of transformation parameters between two point
/// patterns", PAMI 13(4), 1991. Collinear points leave a rotation free: any one is taken.
Similarity AlignPoints(const std::vector<Eigen::Vector3d>& source,
                       const std::vector<Eigen::Vector3d>& target, TrajectoryAlignment alignment);

/// The estimate's poses with the truth's at the same times.
struct PosePair {
  Timestamp time_ns = 0;
  Rigid3 estimate;
  Rigid3 truth;
};

/// Truth is interpolated where it is at least as dense as `frame_interval_ns` (0: the estimate's
/// own median), else the nearest within half of that. Estimates without truth are left out.
std::vector<PosePair> Associate(const Trajectory& estimate, const Trajectory& truth,
                                Timestamp frame_interval_ns = 0);

/// Errors of a trajectory (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems",
/// IROS 2012). Root mean squares over `pairs`.
struct TrajectoryScore {
  std::size_t pairs = 0;
  double ate_se3_m = 0;
  double ate_sim3_m = 0;
  double ate_null_m = 0;  // of a camera that never moved, over the same poses
  double scale = 1;       // of the Sim3 alignment: truth = scale * estimate
  double rotation_se3_deg = 0;
  double rotation_sim3_deg = 0;
  /// Error of the motion over one second, in camera coordinates; `alignment` says whether lengths
  /// are multiplied by `scale` first. Nothing if no two poses are a second apart.
  std::optional<double> rpe_1s_m;
  std::optional<double> rpe_1s_deg;
};

/// `alignment` only chooses the lengths of the relative error: kSim3 for maps without a metric
/// scale. FailedPrecondition: fewer than three pairs.
absl::StatusOr<TrajectoryScore> Score(const std::vector<PosePair>& pairs,
                                      TrajectoryAlignment alignment);

}  // namespace saccade
