#pragma once

#include <Eigen/Dense>
#include <random>
#include <span>
#include <variant>
#include <vector>

#include "server/filter/filter_state.hpp"

namespace saccade {

/// A match as evidence for the camera's pose: what was predicted, and where it was found.
struct PoseEvidence {
  std::variant<PointFromClone, Eigen::Vector3d> point;  // [m, world] if known
  PredictedPixel predicted;                             // at the predicted pose
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d noise = Eigen::Matrix2d::Identity();  // R [px^2]
};

/// The camera pose that the filter predicted: mean and covariance [position, rotation].
struct PosePrior {
  Rigid3 world_from_camera;
  Matrix6d covariance = Matrix6d::Identity();
};

struct RobustPoseOptions {
  int iterations = 12;
  /// Mahalanobis distance at which a match has no say any more, once the scale has settled. 2-D:
  /// 4.5 leaves one good match in 25 000 out.
  double cutoff = 4.5;
  /// chi2(2, 0.95): agreement with a 1-point hypothesis (slam-spec 5.5).
  double agree_chi2 = 5.99;
  int max_hypotheses = 100;
};

struct RobustPose {
  Rigid3 world_from_camera;
  Matrix6d covariance = Matrix6d::Identity();  // given the evidence, map uncertainty included
  std::vector<double> weights;                 // of each match in [0, 1]; 0: outlier
  std::vector<double> squared_distances;       // Mahalanobis, 2 degrees of freedom
  double scale = 1.0;                          // robust scale it started from
  int inliers = 0;                             // weights above 0.1
};

/// Where a point would be seen from `pose` when the map moves with the pose as the filter's
/// correlations say: mean and, given the pose, covariance without measurement noise.
struct ConditionalPixel {
  Eigen::Vector2d pixel;
  Eigen::Matrix2d covariance;
  Eigen::Matrix<double, 2, 6> d_pose;  // total effect of the pose error, at `pose`
};
std::optional<ConditionalPixel> PixelGivenPose(
    const CameraModel& camera, const PosePrior& prior, const Eigen::LLT<Matrix6d>& prior_factor,
    const std::variant<PointFromClone, Eigen::Vector3d>& point, const PredictedPixel& predicted,
    const Rigid3& pose);

/// Pose from matches with outliers and the motion prior (slam-spec 5.5, findings): the best 1-point
/// hypothesis starts a Tukey-weighted Gauss-Newton iteration whose scale begins at the median
/// residual and ends at one. The map's uncertainty enters each match's covariance; what the map
/// would move along with the pose enters its Jacobian. `random` orders the hypotheses.
RobustPose EstimateRobustPose(const CameraModel& camera, const PosePrior& prior,
                              std::span<const PoseEvidence> evidence,
                              const RobustPoseOptions& options, std::mt19937_64& random);

}  // namespace saccade
