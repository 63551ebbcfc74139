#pragma once

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scene/triangle_tree.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// Something that holds and stops. `in_world` may be concave; where it has an inside (IsClosed) and
/// shows its outside, that is full.
struct Obstacle {
  std::string id, name;
  TriangleMesh in_world;
};

/// A thing to be moved, in its own frame.
class Body {
 public:
  explicit Body(const TriangleMesh& mesh);
  ~Body();
  Body(Body&&) noexcept;

  /// Its triangles with this pose; owner 0.
  TriangleTree Moved(const Rigid3& world_from_body) const;

 private:
  friend class CollisionScene;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Obstacles, ready to be asked what touches them. Immutable: any thread.
class CollisionScene {
 public:
  explicit CollisionScene(std::vector<Obstacle> obstacles);
  ~CollisionScene();
  CollisionScene(CollisionScene&&) noexcept;

  const std::vector<Obstacle>& obstacles() const;
  /// Index of an obstacle that the body runs into, is inside of, or has inside itself. Surfaces by
  /// FCL, triangle against triangle; touching counts.
  std::optional<std::size_t> Overlap(const Body& body, const Rigid3& world_from_body) const;
  /// As TriangleTree::Sweep, the owner being the obstacle's index.
  std::optional<SweepHit> Sweep(const Body& body, const Rigid3& world_from_body,
                                const Eigen::Vector3d& direction, double most_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
