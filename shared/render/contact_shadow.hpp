#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shared/render/placed_mesh.hpp"

namespace saccade {

/// Soft dark patches where virtual things rest on something, in world.
struct ShadowMesh {
  std::vector<Eigen::Vector3f> positions;  // [m]
  std::vector<float> darkness;             // of each, 0 .. 1
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Of every virtual mesh that stands on a real or virtual one, down being +y of the world: dark
/// under its foot, gone some centimetres beside it, and only where there is something to fall on.
ShadowMesh ContactShadows(std::span<const PlacedMesh> meshes);

}  // namespace saccade
