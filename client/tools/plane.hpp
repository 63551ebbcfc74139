#pragma once

#include <Eigen/Dense>
#include <optional>
#include <vector>

namespace saccade::tools {

struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    // [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit
  double residual_m = 0;  // root mean square distance of the points from it
};

/// Least-squares plane through at least three points; nothing if they lie on a line.
std::optional<Plane> FitPlane(const std::vector<Eigen::Vector3d>& points);

/// Where a ray meets the plane in front of its origin; nothing if it is seen edge-on.
std::optional<Eigen::Vector3d> Intersect(const Plane& plane, const Eigen::Vector3d& origin,
                                         const Eigen::Vector3d& direction);

}  // namespace saccade::tools
