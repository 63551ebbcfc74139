#pragma once

#include <memory>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// A mesh of a scene where it is now.
struct PlacedMesh {
  std::shared_ptr<const TriangleMesh> mesh;  // never null
  Rigid3 world_from_mesh;
  SceneMaterial material = SceneMaterial::kReal;
};

}  // namespace saccade
