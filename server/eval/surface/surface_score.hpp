#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "server/eval/surface/mesh_view.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {

/// A surface against the simulator's rooms, each part as the nearest keyframe that looks at it has
/// it: an error of that keyframe's place in the world is the tracker's, and not counted again.
/// A map without metres is scaled as a whole, by how far its keyframes are apart.
///
///   points_good       share of the mesh's corners within 3 cm, or 3 % of their distance, of a true
///                     surface
///   covered           share of the true surface seen from two places (their rays at least 2.3 deg
///                     apart) where a keyframe's view of the mesh shows it, within the same
///   false_before      share of the pixels of such views in which the mesh stands more than 10 cm
///                     before whatever is really there
nlohmann::ordered_json ScoreSurface(const SimSource& truth, const SurfaceMap& surfaces,
                                    const WholeMesh& mesh, bool metric);

}  // namespace saccade
