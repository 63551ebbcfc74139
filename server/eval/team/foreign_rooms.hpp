#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "server/eval/team/point_rooms.hpp"
#include "server/team/merge/map_joiner.hpp"

namespace saccade {

/// Two walkers, and what came of it.
struct WalkersResult {
  bool merged = false;
  int places = 0;       // recognised, right or wrong
  double after_s = 0;   // of the keyframe that merged them
  double common_s = 0;  // when both first had a common view: cameras within 0.5 m and 30 deg
  double off_m = 0, off_deg = 0;  // worst of points 2 m from the middle of the room, and rotation
  double nees = 0;                // of own_from_other against its covariance, 7 or 6 numbers
};

/// Both tell each other their keyframes in the order of time. `truth`: own map from other map;
/// without: there is none.
WalkersResult LetMeet(const std::vector<TeamKeyframe>& own, const std::vector<TeamKeyframe>& other,
                      const std::optional<Similarity3>& truth,
                      const MapJoinerOptions& options = {});

/// `pairs` pairs of different rooms that share what RoomsShare lists, by turns: none may be merged.
/// And for each ten of them one pair of walkers in one room, who must be: else it proves nothing.
nlohmann::ordered_json RunForeignRooms(int pairs, std::uint64_t seed);

}  // namespace saccade
