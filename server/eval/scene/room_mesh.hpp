#pragma once

#include "server/sim/surface.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// The simulated room's surfaces as a mesh, in world.
TriangleMesh RoomMeshOf(const RoomScene& room);

}  // namespace saccade
