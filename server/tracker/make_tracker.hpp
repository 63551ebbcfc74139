#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/tracker/frame_tracker.hpp"
#include "server/tracker/landmark_options.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade {

/// The tracker of natural features, with squares beside them where `landmarks` wants some.
/// InvalidArgument: options out of range; landmarks.mode koller.
absl::StatusOr<std::unique_ptr<Tracker>> MakeTracker(const SourceInfo& source,
                                                     const TrackerOptions& options,
                                                     const LandmarkOptions& landmarks);
/// The same, or Koller's with landmarks.mode koller.
absl::StatusOr<std::unique_ptr<FrameTracker>> MakeFrameTracker(const SourceInfo& source,
                                                               const TrackerOptions& options,
                                                               const LandmarkOptions& landmarks);

}  // namespace saccade
