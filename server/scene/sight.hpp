#pragma once

#include <array>
#include <vector>

#include "server/scene/triangle_tree.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// What stands still in the world and cannot be seen through: tells what a camera cannot see.
/// Immutable: any thread.
class Sight {
 public:
  /// Surfaces in the world; either side hides.
  explicit Sight(const std::vector<TriangleMesh>& in_world);

  /// Whether a surface is between an eye and a point, more than kSlack_m before the point: what
  /// hangs on a wall is not hidden by the wall, also where the model of it is not exact.
  bool Hides(const Eigen::Vector3d& eye_in_world, const Eigen::Vector3d& point_in_world) const;

  /// The same of the four corners of something flat.
  std::array<bool, 4> Hides(const Eigen::Vector3d& eye_in_world,
                            const std::array<Eigen::Vector3d, 4>& corners_in_world) const;

  static constexpr double kSlack_m = 0.05;

 private:
  TriangleTree tree_;
};

}  // namespace saccade
