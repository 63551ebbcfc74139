#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <vector>

namespace saccade {

/// A triangle somewhere, and whose it is.
struct OwnedTriangle {
  std::array<Eigen::Vector3d, 3> corners;  // [m]
  std::uint32_t owner = 0;
};

/// Where two surfaces first touch when one is moved along a direction.
struct SweepHit {
  double distance_m = 0;                            // >= 0
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // on the surface that stands still
  /// Unit, from the surface that stands still, against the direction of motion.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  std::uint32_t owner = 0;  // of the triangle that stands still
};

/// Triangles in a binary tree of axis-parallel boxes. Immutable: any thread.
class TriangleTree {
 public:
  explicit TriangleTree(std::vector<OwnedTriangle> triangles);

  const std::vector<OwnedTriangle>& triangles() const { return triangles_; }

  /// How far `moving` may go along `direction` (unit), from where it is, before its surface touches
  /// this one, exactly: corners against faces both ways, edges against edges. Nothing within
  /// `most_m`: none. Surfaces that slide along each other do not touch.
  std::optional<SweepHit> Sweep(const TriangleTree& moving, const Eigen::Vector3d& direction,
                                double most_m) const;

  /// For each owner, how often the half-line from `point` goes through its triangles.
  std::vector<int> Crossings(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                             std::size_t owners) const;

  /// How far `point` is from what it meets first along `direction` (unit); nothing within `most_m`:
  /// none.
  std::optional<double> FirstHit(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                                 double most_m) const;

 private:
  struct Node {
    Eigen::Array3d low, high;
    std::uint32_t first = 0;  // triangle (leaf) or left child; the right one follows it
    std::uint32_t count = 0;  // 0: inner node
  };
  struct Search;

  void Build(std::size_t node, std::uint32_t first, std::uint32_t count);
  void Visit(std::size_t node, const TriangleTree& moving, std::size_t moving_node,
             Search& search) const;

  std::vector<OwnedTriangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace saccade
