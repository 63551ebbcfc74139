#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/eval/commands.hpp"
#include "server/tracker/landmark_options.hpp"
#include "server/tracker/tracker.hpp"
#include "server/wearable/wearable.hpp"

namespace saccade {

/// What `--config` and `--set` say of tracking.
struct TrackerSetup {
  TrackerOptions tracker;
  LandmarkOptions landmarks;
};

/// `tracker=koller|fused|natural`, `landmarks.KEY=VALUE` and TrackerOptions' own. Errors name the
/// key and what it may be.
absl::StatusOr<TrackerSetup> ReadSetup(const TrackerArguments& arguments);

/// The product's tracker for one source, with `--config` and `--set`: natural features, and squares
/// where these are given. InvalidArgument, too: `tracker=koller`.
absl::StatusOr<std::unique_ptr<Tracker>> MakeTracker(const SourceInfo& info,
                                                     const TrackerArguments& arguments);
/// The same, or Koller's.
absl::StatusOr<std::unique_ptr<FrameTracker>> MakeFrameTracker(const SourceInfo& info,
                                                               const TrackerArguments& arguments);

/// A wearable with that tracker; annotations are kept in memory alone.
absl::StatusOr<std::unique_ptr<Wearable>> MakeWearable(const SourceInfo& info,
                                                       const TrackerArguments& arguments);

/// What an expert does: a Create, answered at once. `number`: of the request, above 0.
absl::StatusOr<Annotation> PlaceAsExpert(Wearable& wearable, AnnotationTarget target, int number);

}  // namespace saccade
