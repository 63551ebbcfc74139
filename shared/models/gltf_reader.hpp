#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstddef>

#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

struct GltfLimits {
  std::size_t bytes = std::size_t{32} << 20;
  std::size_t triangles = 200'000;
  std::size_t vertices = 600'000;
  std::size_t nodes = 10'000;
  double extent_m = 1000.0;  // farthest from the origin
};

/// The triangles of a GLB file (glTF 2.0, one file with everything in it), the transforms of its
/// nodes applied, turned from glTF's frame (y up, z to the viewer) into that of TriangleMesh.
/// Colours are the materials' base colour factors; textures, skins and animations are left out.
/// Nothing is allocated for what the file says of itself before that was checked.
///
/// Messages begin with "model: " and say the remedy.
///   InvalidArgument    torn, not glTF 2.0, parts outside the file, NaN or infinite positions, no
///                      triangles, files beside it, compressed or sparse data
///   ResourceExhausted  beyond `limits`; the numbers and the limit are told
absl::StatusOr<TriangleMesh> ReadGlb(absl::string_view bytes, const GltfLimits& limits = {});

}  // namespace saccade
