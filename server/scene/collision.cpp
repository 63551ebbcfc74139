#include "server/scene/collision.hpp"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>

#include <numeric>

#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

using FclMesh = fcl::BVHModel<fcl::OBBRSSd>;

/// Against rays that run along edges: three directions, and most of them decide.
const std::array<Eigen::Vector3d, 3> kRays = {Eigen::Vector3d(0.531, 0.622, 0.575).normalized(),
                                              Eigen::Vector3d(-0.713, 0.287, 0.641).normalized(),
                                              Eigen::Vector3d(0.219, -0.811, -0.543).normalized()};

double SignedVolume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.positions[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.positions[t[1]].cast<double>();
    sum += a.dot(b.cross(mesh.positions[t[2]].cast<double>())) / 6.0;
  }
  return sum;
}

/// One corner of each part that hangs together.
std::vector<Eigen::Vector3d> Representatives(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    parent[root(t[0])] = root(t[1]);
    parent[root(t[1])] = root(t[2]);
  }
  std::vector<bool> told(mesh.positions.size());
  std::vector<Eigen::Vector3d> points;
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    const std::uint32_t part = root(t[0]);
    if (!told[part]) points.push_back(mesh.positions[t[0]].cast<double>());
    told[part] = true;
  }
  return points;
}

void AddTriangles(const TriangleMesh& mesh, std::uint32_t owner,
                  std::vector<OwnedTriangle>& triangles) {
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    OwnedTriangle one;
    for (std::size_t k = 0; k < 3; ++k) one.corners[k] = mesh.positions[t[k]].cast<double>();
    one.owner = owner;
    triangles.push_back(one);
  }
}

std::unique_ptr<FclMesh> MakeFcl(const std::vector<OwnedTriangle>& triangles) {
  auto made = std::make_unique<FclMesh>();
  std::vector<Eigen::Vector3d> corners;
  std::vector<fcl::Triangle> indices;
  for (const OwnedTriangle& triangle : triangles) {
    const std::size_t base = corners.size();
    corners.insert(corners.end(), triangle.corners.begin(), triangle.corners.end());
    indices.emplace_back(base, base + 1, base + 2);
  }
  made->beginModel(static_cast<int>(indices.size()), static_cast<int>(corners.size()));
  made->addSubModel(corners, indices);
  made->endModel();
  return made;
}

}  // namespace

struct Body::Impl {
  std::vector<OwnedTriangle> triangles;
  std::unique_ptr<FclMesh> fcl;
  std::vector<Eigen::Vector3d> representatives;
  bool full = false;  // has an inside
};

Body::Body(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  AddTriangles(mesh, 0, impl_->triangles);
  impl_->fcl = MakeFcl(impl_->triangles);
  impl_->representatives = Representatives(mesh);
  impl_->full = IsClosed(mesh) && SignedVolume(mesh) > 0;
}
Body::~Body() = default;
Body::Body(Body&&) noexcept = default;

TriangleTree Body::Moved(const Rigid3& world_from_body) const {
  std::vector<OwnedTriangle> moved = impl_->triangles;
  for (OwnedTriangle& triangle : moved) {
    for (Eigen::Vector3d& corner : triangle.corners) corner = world_from_body * corner;
  }
  return TriangleTree(std::move(moved));
}

struct CollisionScene::Impl {
  std::vector<Obstacle> obstacles;
  std::vector<bool> full;
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> representatives;
  std::unique_ptr<TriangleTree> tree;
  std::unique_ptr<FclMesh> fcl;  // in the order of the tree's triangles

  /// Index of a full obstacle that `point` is inside of.
  std::optional<std::size_t> Inside(const Eigen::Vector3d& point) const {
    std::vector<int> votes(obstacles.size());
    for (const Eigen::Vector3d& ray : kRays) {
      const std::vector<int> crossings = tree->Crossings(point, ray, obstacles.size());
      for (std::size_t i = 0; i < votes.size(); ++i) votes[i] += crossings[i] % 2;
    }
    for (std::size_t i = 0; i < votes.size(); ++i) {
      if (full[i] && votes[i] >= 2) return i;
    }
    return std::nullopt;
  }
};

CollisionScene::CollisionScene(std::vector<Obstacle> obstacles) : impl_(std::make_unique<Impl>()) {
  impl_->obstacles = std::move(obstacles);
  std::vector<OwnedTriangle> triangles;
  for (std::size_t i = 0; i < impl_->obstacles.size(); ++i) {
    const TriangleMesh& mesh = impl_->obstacles[i].in_world;
    AddTriangles(mesh, static_cast<std::uint32_t>(i), triangles);
    impl_->full.push_back(IsClosed(mesh) && SignedVolume(mesh) > 0);
    for (const Eigen::Vector3d& point : Representatives(mesh)) {
      impl_->representatives.emplace_back(i, point);
    }
  }
  impl_->tree = std::make_unique<TriangleTree>(std::move(triangles));
  if (!impl_->tree->triangles().empty()) impl_->fcl = MakeFcl(impl_->tree->triangles());
}
CollisionScene::~CollisionScene() = default;
CollisionScene::CollisionScene(CollisionScene&&) noexcept = default;

const std::vector<Obstacle>& CollisionScene::obstacles() const { return impl_->obstacles; }

std::optional<std::size_t> CollisionScene::Overlap(const Body& body,
                                                   const Rigid3& world_from_body) const {
  if (impl_->fcl == nullptr || body.impl_->triangles.empty()) return std::nullopt;
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  pose.linear() = world_from_body.RotationMatrix();
  pose.translation() = world_from_body.translation;
  fcl::CollisionResultd result;
  fcl::collide(impl_->fcl.get(), fcl::Transform3d::Identity(), body.impl_->fcl.get(), pose,
               fcl::CollisionRequestd(1), result);
  if (result.isCollision()) {
    const auto triangle = static_cast<std::size_t>(result.getContact(0).b1);
    return impl_->tree->triangles()[triangle].owner;
  }
  for (const Eigen::Vector3d& point : body.impl_->representatives) {
    const std::optional<std::size_t> around = impl_->Inside(world_from_body * point);
    if (around) return around;
  }
  if (!body.impl_->full) return std::nullopt;
  const TriangleTree moved = body.Moved(world_from_body);
  for (const auto& [obstacle, point] : impl_->representatives) {
    int votes = 0;
    for (const Eigen::Vector3d& ray : kRays) votes += moved.Crossings(point, ray, 1)[0] % 2;
    if (votes >= 2) return obstacle;
  }
  return std::nullopt;
}

std::optional<SweepHit> CollisionScene::Sweep(const Body& body, const Rigid3& world_from_body,
                                              const Eigen::Vector3d& direction,
                                              double most_m) const {
  return impl_->tree->Sweep(body.Moved(world_from_body), direction, most_m);
}

}  // namespace saccade
