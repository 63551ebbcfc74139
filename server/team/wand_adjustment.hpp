#pragma once

#include <Eigen/Dense>
#include <map>
#include <optional>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What one static camera sees of a body with known points at one instant.
struct WandView {
  int camera = 0;                       // index of a lens
  int instant = 0;                      // index of a body pose
  std::vector<Eigen::Vector3d> points;  // in the body [m]
  std::vector<Eigen::Vector2d> pixels;  // [px, distorted]
};

/// Static cameras, and a body's pose at each instant; what is not placed yet is left out.
struct WandPoses {
  std::vector<std::optional<Rigid3>> world_from_camera, world_from_wand;
};

struct WandFit {
  double rms_px = 0.0;  // per point, weighted as below
  std::size_t points = 0;
  /// Of each camera that was free: [position in world, rotation (local)], given the fixed one.
  std::map<int, Matrix6d> camera_covariance;
};

/// All cameras stay.
inline constexpr int kAllCameras = -1;

/// Moves all placed cameras but `fixed`, and all placed bodies, to where their views fit best:
/// Levenberg-Marquardt on reprojection errors with Student's t (4 degrees of freedom, `sigma_px`),
/// bodies eliminated by the Schur complement. Views of what is not placed are passed over.
/// Nothing if no view is left or the system is singular; `poses` is then as it was.
std::optional<WandFit> AdjustWand(const std::vector<CameraModel>& lenses,
                                  const std::vector<WandView>& views, int fixed, double sigma_px,
                                  int iterations, WandPoses& poses);

/// Root mean square error of a view [px]; nothing if a point is behind the camera.
std::optional<double> ViewError(const CameraModel& lens, const WandView& view,
                                const Rigid3& camera_from_wand);

}  // namespace saccade
