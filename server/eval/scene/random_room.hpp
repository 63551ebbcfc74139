#pragma once

#include <random>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// A mesh by name, as things in rooms are: most are concave.
struct NamedMesh {
  std::string name;
  TriangleMesh mesh;  // closed, but for the room
  Rigid3 world_from_mesh;
};

/// A room and its furniture: tables, shelves with open fronts, L-shaped benches, arches, rings,
/// pipes, balls, some on a slant, and some things of up to 2000 triangles. They may cut each other,
/// as built-in things do.
std::vector<NamedMesh> RandomRoom(std::mt19937_64& random);

/// One of those things, of random proportions, to be placed.
NamedMesh RandomThing(std::mt19937_64& random);

}  // namespace saccade
