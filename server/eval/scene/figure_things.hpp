#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "shared/render/placed_mesh.hpp"

namespace saccade {

// What is virtual in the figures, in FigureRoom's world. Furniture is placed by Place(): pushed
// until it touches, lowered until it rests; its errors pass through.

/// Shelf and desk, pushed to the wall.
absl::StatusOr<std::vector<PlacedMesh>> PushedFurniture(const TriangleMesh& room);
/// The same behind what stands in the room: partly covered.
absl::StatusOr<std::vector<PlacedMesh>> FurnitureBehindCartons(const TriangleMesh& room);
/// What only guides the eye: nothing is placed, nothing can fail.
std::vector<PlacedMesh> DividerAndGrid();
std::vector<PlacedMesh> HiddenWires();
std::vector<PlacedMesh> EscapeRoute();
std::vector<PlacedMesh> RedArrow();
std::vector<PlacedMesh> HoseInCabinet();
std::vector<PlacedMesh> GridAndPerson();

}  // namespace saccade
