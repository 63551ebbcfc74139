#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <cstdint>
#include <string>
#include <vector>

#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// A part of a scene: either triangles with a colour at each corner, or lines.
struct GlbPart {
  std::string name;
  std::vector<Eigen::Vector3f> positions;  // world: x right, y down, z away [m]
  std::vector<std::uint8_t> colors_rgba;   // four for each position; empty: `color_rgba` for all
  std::uint32_t color_rgba = 0xffffffff;
  std::vector<std::uint32_t> triangles;  // corners, three each
  std::vector<std::uint32_t> lines;      // ends, two each, where there are no triangles
};

/// A GLB file (glTF 2.0, everything in one), a node for each part, turned into glTF's frame (y up).
/// Colours are what they look like: nothing is to be lit. InvalidArgument: there is nothing in it.
absl::StatusOr<std::string> WriteGlb(const std::vector<GlbPart>& parts);
/// `mesh` as a part for each colour, corners not shared. ReadGlb gives the same triangles back,
/// sorted by colour.
absl::StatusOr<std::string> WriteGlb(const TriangleMesh& mesh);

}  // namespace saccade
