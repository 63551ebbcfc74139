#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// Says whether things cut each other and how far they are apart, by brute force over all pairs of
/// triangles: no tree, no library, nothing of server/scene. Only pairs whose boxes are far apart
/// are left out.
class PlacementJudge {
 public:
  using Triangle = std::array<Eigen::Vector3d, 3>;

  /// `solids`: which of the meshes are full inside.
  PlacementJudge(const std::vector<TriangleMesh>& in_world, const std::vector<bool>& solids);

  /// Surfaces cut, or one lies within the other.
  bool Cuts(const TriangleMesh& body, const Rigid3& world_from_body) const;
  /// Least distance of the surfaces [m], at most `most_m` (then that).
  double Distance(const TriangleMesh& body, const Rigid3& world_from_body, double most_m) const;
  /// How far it may go along `direction` (unit) before it cuts [m], by bisection to 1e-6 m over
  /// `most_m`, at whose end it must cut; negative: how far it must go back, at most `most_m`;
  /// `most_m` or -`most_m`: beyond.
  double Gap(const TriangleMesh& body, const Rigid3& world_from_body,
             const Eigen::Vector3d& direction, double most_m) const;

 private:
  std::vector<std::vector<Triangle>> meshes_;
  std::vector<bool> solids_;
};

/// Exact distance of two triangles: corners to faces, edges to edges; 0 if they cut.
double TriangleDistance(const PlacementJudge::Triangle& a, const PlacementJudge::Triangle& b);
/// An edge of one goes through the other.
bool TrianglesCut(const PlacementJudge::Triangle& a, const PlacementJudge::Triangle& b);

}  // namespace saccade
