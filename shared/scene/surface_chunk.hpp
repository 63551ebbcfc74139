#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <vector>

namespace saccade {

/// A cube of the place's surface: triangles with a colour at each corner. Immutable once made.
///
/// Corner i lies at origin + step * positions[i] of the world. Chunks that touch share positions
/// along their border. A triangle is counter-clockwise as seen from where the surface was seen.
struct SurfaceChunk {
  using Index = std::array<std::int32_t, 3>;
  using Triangle = std::array<std::uint16_t, 3>;

  Index index{};              // names it within one generation of the map
  std::uint64_t version = 0;  // rises with every change of any chunk
  Eigen::Vector3f origin_in_world = Eigen::Vector3f::Zero();  // [m]
  float step_m = 0.0f;
  std::uint16_t span = 65'535;  // steps along each side of its cube: no position is beyond
  std::vector<std::array<std::uint16_t, 3>> positions;
  std::vector<std::array<std::uint8_t, 3>> colors_rgb;  // of each position
  std::vector<Triangle> triangles;  // of positions; none: nothing is known there

  Eigen::Vector3f Point(std::size_t i) const {
    return origin_in_world +
           step_m * Eigen::Vector3f(positions[i][0], positions[i][1], positions[i][2]);
  }
};

}  // namespace saccade
