#pragma once

#include <Eigen/Dense>
#include <optional>

#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// Where a line of sight meets the surface.
struct SurfaceHit {
  double range = 0.0;                                         // along the ray, in the map's unit
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::Zero();  // unit, towards where the ray begins
};

/// The nearest triangle that the ray meets, from either side, beyond `nearest`; nothing: a hole.
/// `ray_in_world`: unit. Boxes first, then the triangles of the chunks that it passes.
std::optional<SurfaceHit> CastOnSurface(const SurfaceSnapshot& surface,
                                        const Eigen::Vector3d& origin_in_world,
                                        const Eigen::Vector3d& ray_in_world, double nearest = 0.0);

}  // namespace saccade
