#pragma once

#include <Eigen/Dense>
#include <map>
#include <optional>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What one frame saw: for LensFit.
struct LensView {
  struct Seen {
    FeatureId id = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  };
  Rigid3 world_from_camera;
  std::vector<Seen> seen;
};

/// How far the pictures contradict the lens that they are said to be of.
struct LensFit {
  /// Pixels are where the lens says, times 1 + stretch[0] + stretch[1] rho^2 from (cx, cy), where
  /// rho is the distance from there in half diagonals of the picture.
  Eigen::Vector2d stretch = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  double rms_px = 0.0;       // of the residuals, with the lens as it is said to be
  double best_rms_px = 0.0;  // with the stretched one
  int observations = 0;

  double StretchAt(double rho) const { return stretch[0] + stretch[1] * rho * rho; }
  double SigmaAt(double rho) const;
};

/// Adjusts poses, points and the stretch together (Gauss-Newton, points eliminated, Huber), from
/// views that overlap. Nothing: too few points are in three views or more, or it does not converge.
/// Cost: some 20 ms for 12 views of 60 points.
std::optional<LensFit> FitLens(const CameraModel& camera, std::vector<LensView> views,
                               const std::map<FeatureId, Eigen::Vector3d>& points_in_world);

}  // namespace saccade
