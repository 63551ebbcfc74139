#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/pipeline/events.hpp"
#include "server/scene/sight.hpp"
#include "server/tracker/carried_squares.hpp"
#include "shared/render/placed_mesh.hpp"
#include "shared/scene/marker_pose.hpp"
#include "shared/scene/scene_object.hpp"

/// What follows from a scene for those who draw it, track in it and are hidden by it.
namespace saccade {

/// What is real and stands in the world, for what it hides; null: nothing.
std::shared_ptr<const Sight> SightOf(const Scene& scene);

/// Markers that objects are fixed to, each once.
CarriedSquareList CarriedOf(const Scene& scene);

/// Meshes of a scene where they are now. What is fixed to an annotation or a marker whose place is
/// not known is left out.
std::vector<PlacedMesh> PlacedMeshes(const Scene& scene, const AnnotationList& annotations,
                                     std::span<const MarkerPose> markers);

}  // namespace saccade
