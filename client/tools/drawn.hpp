#pragma once

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "client/tools/landing.hpp"
#include "client/tools/plane.hpp"
#include "client/tools/view.hpp"

namespace saccade::tools {

/// The plane that something is drawn in: the surface that was pressed, or one that faces the eye.
Plane PlaneOf(const View& view, const Landing& landing);

/// Where a pixel's ray meets it [m]; nothing outside the lens or where it is seen edge-on.
std::optional<Eigen::Vector3d> OnPlane(const View& view, const Plane& plane,
                                       const Eigen::Vector2d& pixel);

struct DrawnBox {
  Eigen::Vector3d middle_in_world = Eigen::Vector3d::Zero();  // [m]
  Eigen::Quaterniond world_from_mark = Eigen::Quaterniond::Identity();
  Eigen::Vector3d extent_m = Eigen::Vector3d::Zero();  // each 0.01 to 10
};

/// From one corner to the other, upright, its x axis to the right as the eye sees it; half as deep
/// as the less wide of its sides where they lie in a plane.
DrawnBox BoxBetween(const View& view, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// A stroke's points relative to its first one, each smoothed with its neighbours [m]; at most
/// 2000. Empty if it is no stroke (fewer than two points).
std::vector<Eigen::Vector3d> StrokeOf(const std::vector<Eigen::Vector3d>& points_in_world);

}  // namespace saccade::tools
