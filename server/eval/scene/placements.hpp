#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace saccade {

/// What one thing did, as PlacementJudge sees it.
struct PlacementOutcome {
  std::string thing;
  std::size_t thing_triangles = 0, room_triangles = 0;
  bool pushed = false;
  double slid_m = 0;          // along what stopped it
  std::string stop, support;  // names of what was touched
  /// How far it could go on the way it came, push and fall; negative: it cuts by that.
  double push_gap_m = 0, rest_gap_m = 0;
  double distance_m = 0;  // at rest, to the nearest surface; at most 0.01
  bool path_free = true;  // it cut nothing at a hundred places on its way
  std::string refused;    // else why; then nothing else is said
  bool refused_rightly = true;
};

/// One random room, thing, start and push. Depends on `seed` and `index` alone.
PlacementOutcome RunPlacement(std::uint64_t seed, std::uint64_t index);

struct PlacementsSummary {
  int placed = 0, refused = 0, wrongly_refused = 0, pushed = 0, concave = 0, slid = 0;
  double worst_penetration_m = 0, worst_gap_m = 0;
  int failed = 0;  // penetration or gap of 1 mm and more, or something in the way was passed
};

/// Places until `count` things rest; writes DIR/placements.csv and DIR/report.json. `progress` is
/// told the number of those placed.
absl::StatusOr<PlacementsSummary> RunPlacements(std::uint64_t seed, int count,
                                                const std::filesystem::path& out,
                                                const std::function<void(int)>& progress);

}  // namespace saccade
