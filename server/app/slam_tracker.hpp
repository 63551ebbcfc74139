#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/app/frame_tracker.hpp"
#include "server/capture/frame_source.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// The engine's tracker: EKF SLAM of server/tracker. Errors as Tracker::Create.
absl::StatusOr<std::unique_ptr<FrameTracker>> MakeSlamTracker(const SourceInfo& source,
                                                              const TrackerOptions& options);

}  // namespace saccade
