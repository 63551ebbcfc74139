#pragma once

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "server/anchors/depth_doubt.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// What the place's surfaces have where somebody looks.
struct SurfaceLook {
  double range_m = 0.0;  // along the line of sight
  double sigma_m = 0.0;
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::Zero();  // unit, towards the eye
  /// A few pixels beside it another surface is seen, or a hole; then the range is one of two.
  bool outline = false;
  double other_range_m = 0.0;  // 0: a hole, or no outline
};

/// Nothing: a hole. `ray_in_world`: unit.
std::optional<SurfaceLook> LookAtSurface(const SurfaceSnapshot& surface,
                                         const Eigen::Vector3d& eye_in_world,
                                         const Eigen::Vector3d& ray_in_world,
                                         double radians_per_px);

/// What is seen of surfaces around a line of sight that passes through a hole, as `rotated` has it
/// (its z axis is the ray): bare walls and tables go on between what has texture.
std::vector<SurfaceSample> SurfaceAround(const SurfaceSnapshot& surface,
                                         const Rigid3& ray_from_world, double radians_per_px);

/// Through a hole between surfaces something else may be seen than what goes on around it: nobody
/// has seen that it does. A feature at the very pixel knows better.
void DoubtHole(const SurfaceDepth& depth, DepthDoubt& doubt);

/// Takes the surface's word on a depth (slam-spec section 9: it comes first), but for a feature at
/// the very pixel that agrees: that is finer. Where an outline is near, what was found otherwise
/// stands, and the other surface is in doubt.
void TakeSurface(const SurfaceLook& look, SurfaceDepth& depth, DepthDoubt& doubt);

}  // namespace saccade
