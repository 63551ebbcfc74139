#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

struct PoseFitOptions {
  double sigma_px = 0.5;  // measurement noise, each axis
  double huber_px = 2.0;  // residuals beyond count linearly
  int max_iterations = 30;
  /// How well `initial` is known; 0: not at all (no prior).
  double prior_position_sigma_m = 0.0;
  double prior_orientation_sigma_rad = 0.0;
};

struct PoseFit {
  Rigid3 world_from_camera;
  /// [position in world m, local rotation rad]: sigma^2 (J^T J)^-1, with sigma the larger of
  /// options.sigma_px and what the residuals say.
  Matrix6d covariance = Matrix6d::Zero();
  double rms_px = 0.0;  // per point, of all points
};

/// Fits a pose to points by Levenberg-Marquardt on the reprojection error through the real lens.
///
/// `points_in_world` [m] and `pixels` [px, distorted] have the same length >= 3. InvalidArgument:
/// lengths differ or numbers not finite; FailedPrecondition: degenerate (singular) or points behind
/// the camera at `initial`.
absl::StatusOr<PoseFit> FitPose(const CameraModel& camera,
                                std::span<const Eigen::Vector3d> points_in_world,
                                std::span<const Eigen::Vector2d> pixels, const Rigid3& initial,
                                const PoseFitOptions& options);

/// Both poses of a camera that sees coplanar points in the plane z = 0 of world (IPPE), refined
/// through the real lens; best first. At least 4 points, no three of the first four on a line.
absl::StatusOr<std::vector<PoseFit>> FitPlanarPose(const CameraModel& camera,
                                                   std::span<const Eigen::Vector3d> points_in_world,
                                                   std::span<const Eigen::Vector2d> pixels,
                                                   const PoseFitOptions& options);

struct RansacOptions {
  double inlier_px = 3.0;
  int max_iterations = 300;
  double confidence = 0.999;
  int min_inliers = 12;
  std::uint64_t seed = 1;
};

struct RansacPose {
  PoseFit fit;
  std::vector<int> inliers;  // indices into the given points, rising
};

/// Pose from point correspondences with outliers: P3P hypotheses on bearings, LM on the inliers.
/// NotFound: fewer than `min_inliers` agree. Deterministic for one seed.
absl::StatusOr<RansacPose> FitPoseRansac(const CameraModel& camera,
                                         std::span<const Eigen::Vector3d> points_in_world,
                                         std::span<const Eigen::Vector2d> pixels,
                                         const RansacOptions& options);

}  // namespace saccade
