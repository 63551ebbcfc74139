#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "server/capture/frame_source.hpp"
#include "server/eval/run.hpp"
#include "server/team/merge/map_joiner.hpp"

namespace saccade {

/// One of two wearers: his recording, his tracker, the truth of his camera.
struct PairMember {
  std::string name;
  FrameSource* source = nullptr;
  TrackFunction track;
  Trajectory truth;  // of both in one world; empty: nothing is scored
};

struct PairOptions {
  MapJoinerOptions joiner;
  std::filesystem::path out;  // alone in it: NAME/ of each, as RunTracker has them
};

/// Two recordings side by side, frame by frame by the time since each began. Each wearer's map
/// hears the other's keyframes and looks for itself (two joiners, both orders). The trackers hear
/// nothing: each runs as if it were alone.
///
/// The report: when each order was merged, when both first had a common view by truth (cameras
/// within 0.5 m and 30 deg), how far off the merge is where it began and at the end, and both ATEs.
absl::StatusOr<nlohmann::ordered_json> RunPair(std::array<PairMember, 2> members,
                                               const PairOptions& options);

}  // namespace saccade
