#pragma once

#include <string>

#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// `mesh`, of one triangle at least, as a GLB file (glTF 2.0) in glTF's frame: a part for each
/// colour, corners not shared. ReadGlb gives the same triangles back, sorted by colour.
std::string WriteGlb(const TriangleMesh& mesh);

}  // namespace saccade
