#pragma once

#include <absl/status/statusor.h>

#include "server/anchors/anchor_manager.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/run.hpp"

namespace saccade {

/// A tracker for one source, as evaluations use it.
struct TrackerSession {
  TrackFunction track;
  SeedFeatureFunction seed;    // for AnchorManager
  std::function<void()> wait;  // until nothing runs on other threads: before a fork
};

/// Creates the real tracker. Errors of options name the key and what it may be.
absl::StatusOr<TrackerSession> MakeTrackerSession(const SourceInfo& info,
                                                  const TrackerArguments& arguments);

}  // namespace saccade
