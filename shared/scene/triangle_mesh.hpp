#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <vector>

namespace saccade {

/// A surface of triangles; may be concave, open, or of several parts.
///
/// Model frame: x right, y down (gravity's way), z away from who stands before it [m]. A triangle
/// is counter-clockwise as seen from outside.
struct TriangleMesh {
  using Triangle = std::array<std::uint32_t, 3>;

  std::vector<Eigen::Vector3f> positions;  // [m], finite
  std::vector<Triangle> triangles;         // of positions
  std::vector<std::uint32_t> colors_rgba;  // of each triangle; empty: 0xb4b4b4ff

  bool empty() const { return triangles.empty(); }
};

}  // namespace saccade
