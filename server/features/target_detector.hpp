#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "server/capture/target.hpp"
#include "server/features/image_pyramid.hpp"
#include "server/features/patch.hpp"
#include "server/features/pose_fit.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// A known target seen in one picture: corresponding points and the pose that explains them.
struct TargetObservation {
  std::vector<int> ids;                          // patch id, or chessboard corner j * columns + i
  std::vector<Eigen::Vector2d> pixels;           // [px, distorted, sub-pixel]
  std::vector<Eigen::Vector3d> points_in_world;  // [m]
  Rigid3 world_from_camera;
  Matrix6d pose_covariance = Matrix6d::Zero();  // [position m, local rotation rad]
  double rms_px = 0.0;
  /// A second pose explains the picture nearly as well (planar ambiguity, error ratio below 2).
  bool ambiguous = false;
};

/// Finds the inner corners of `target`'s chessboard and the camera's pose.
///
/// The board looks the same after half a turn. Which corner is (0, 0) is decided by `predicted`
/// (world_from_camera, if known), else by target.hint_px, else corner (0, 0) is the one more up and
/// left. NotFound: no whole board in view. FailedPrecondition: corners do not fit a plane seen by
/// this camera (rms above 2 px). Meant for the start; times in docs/measurements.
absl::StatusOr<TargetObservation> DetectChessboard(const ImagePyramid& pyramid,
                                                   const CameraModel& camera,
                                                   const ChessboardTarget& target,
                                                   const std::optional<Rigid3>& predicted);

/// The same without a judgement of the lens, which may be far from right: corners and the points
/// that they are, in one of the two orders that look alike, and about where the camera is.
absl::StatusOr<TargetObservation> SeeChessboard(const ImagePyramid& pyramid,
                                                const CameraModel& camera,
                                                const ChessboardTarget& target);

struct PatchTargetOptions {
  /// Best score a patch needs: NSSD, as in SearchOptions.
  double max_nssd = 0.40;
  /// Ellipses are this large at most [px, one sigma].
  double max_sigma_px = 25.0;
  int min_points = 3;
};

/// Finds the known patches near where `start` says they are and refines the pose.
///
/// Position and orientation sigma of `start` become ellipses; a consistent set of peaks is chosen;
/// the pose is fitted to it with `start` as prior. NotFound: fewer than `min_points` found.
absl::StatusOr<TargetObservation> DetectPatches(const ImagePyramid& pyramid,
                                                const std::shared_ptr<const CameraModel>& camera,
                                                const PatchTarget& target, const StartPose& start,
                                                const PatchTargetOptions& options = {});

/// The templates of the patches as features to track: entry k belongs to target.points[k] and shows
/// the patch as seen from `world_from_camera` (the start pose).
absl::StatusOr<std::vector<PatchTemplate>> PatchTemplates(
    const PatchTarget& target, const Rigid3& world_from_camera,
    const std::shared_ptr<const CameraModel>& camera);

}  // namespace saccade
