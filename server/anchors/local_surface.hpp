#pragma once

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "server/anchors/anchor_options.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// A feature as seen from the camera that was clicked in, in a frame whose z axis is the ray.
struct SurfaceSample {
  Eigen::Vector3d point_in_ray = Eigen::Vector3d::Zero();  // z > 0 [m]
  double depth_sigma_m = 0;                                // along its own bearing
  bool depth_known = false;
  double trust = 1.0;  // 1; less for features that were searched for and not found (hidden?)
};

/// Depth of the surface along the ray (0, 0, 1).
struct SurfaceDepth {
  AnchorMethod method = AnchorMethod::kMedianDepth;
  double depth_m = 0;
  double sigma_m = 0;
  Eigen::Vector3d normal_in_ray = -Eigen::Vector3d::UnitZ();  // unit, towards the camera
  std::optional<std::size_t> at_feature;  // index of a sample that lies at the very pixel (3 px)
  double nearest_rad = 0;  // of a plane: from the ray to the nearest feature known to lie on it
};

/// Finds the depth along a ray from the features round it, best first:
///   a robust plane through at least three of them that surround the ray,
///   the nearest one within options.feature_radius_px,
///   the weighted median of what is near, with sigma options.median_depth_sigma,
///   the weighted median of everything, with sigma options.far_depth_sigma.
/// A plane predicts at the ray itself, so it beats a feature 15 px away that may lie on something
/// else; a feature within 6 px that contradicts the plane beats it. docs/derivations/anchors.md.
/// Nothing if no sample has a usable depth.
std::optional<SurfaceDepth> EstimateDepth(const std::vector<SurfaceSample>& samples,
                                          double radians_per_px, bool metric,
                                          const AnchorOptions& options);

}  // namespace saccade
