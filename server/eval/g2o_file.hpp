#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <vector>

#include "server/map/pose_graph.hpp"

namespace saccade {

/// A pose graph as g2o writes it, in space or in the plane.
struct G2oGraph {
  PoseGraph graph;                // nodes by rising id; information as in the file
  std::vector<std::int64_t> ids;  // of the nodes
  bool planar = false;            // VERTEX_SE2 and EDGE_SE2: z = 0, turned about z
  bool placed = true;             // false: the file has edges only
};

/// Reads VERTEX_SE3:QUAT and EDGE_SE3:QUAT, or VERTEX_SE2 and EDGE_SE2, and FIX. A planar graph
/// becomes one in space, with an information of 1 for what is not in the plane.
///   NotFound         no such file
///   InvalidArgument  names file, line, problem and remedy; a line cut short and a number that is
///                    not finite are refused
absl::StatusOr<G2oGraph> LoadG2o(const std::filesystem::path& file);

/// Writes it back in the same form, whole or not at all.
absl::Status SaveG2o(const std::filesystem::path& file, const G2oGraph& graph);

}  // namespace saccade
