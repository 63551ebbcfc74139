#include "server/scene/sight.hpp"

#include <utility>

namespace saccade {
namespace {

constexpr double kAtTheEye_m = 0.02;  // nearer, the camera is in the thing: it hides nothing

std::vector<OwnedTriangle> Triangles(const std::vector<TriangleMesh>& meshes) {
  std::vector<OwnedTriangle> triangles;
  for (const TriangleMesh& mesh : meshes) {
    for (const TriangleMesh::Triangle& one : mesh.triangles) {
      OwnedTriangle triangle;
      for (int k = 0; k < 3; ++k) triangle.corners[k] = mesh.positions[one[k]].cast<double>();
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

}  // namespace

Sight::Sight(const std::vector<TriangleMesh>& in_world) : tree_(Triangles(in_world)) {}

bool Sight::Hides(const Eigen::Vector3d& eye_in_world,
                  const Eigen::Vector3d& point_in_world) const {
  const Eigen::Vector3d way = point_in_world - eye_in_world;
  const double distance_m = way.norm();
  const double reach_m = distance_m - kSlack_m - kAtTheEye_m;
  if (!(reach_m > 0.0)) return false;
  const Eigen::Vector3d direction = way / distance_m;
  return tree_.FirstHit(eye_in_world + kAtTheEye_m * direction, direction, reach_m).has_value();
}

std::array<bool, 4> Sight::Hides(const Eigen::Vector3d& eye_in_world,
                                 const std::array<Eigen::Vector3d, 4>& corners_in_world) const {
  std::array<bool, 4> hidden{};
  for (std::size_t c = 0; c < 4; ++c) hidden[c] = Hides(eye_in_world, corners_in_world[c]);
  return hidden;
}

}  // namespace saccade
