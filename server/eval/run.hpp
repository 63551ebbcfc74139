#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/capture/frame_source.hpp"
#include "server/eval/trajectory.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// The tracker as an evaluation sees it: one frame in, what was published out.
using TrackFunction = std::function<std::shared_ptr<const MapSnapshot>(const Frame& frame)>;

using ReportMore = std::function<void(nlohmann::ordered_json& report)>;

/// Runs `track` over every frame of `source` on this thread, writes trajectory.tum, frames.csv and
/// report.json into `folder` and answers with the report. `truth` may be empty. `more` adds to the
/// report what else is known. Tells how far it is on stderr every ten seconds.
absl::StatusOr<nlohmann::ordered_json> RunTracker(FrameSource& source, const TrackFunction& track,
                                                  const Trajectory& truth,
                                                  const std::filesystem::path& folder,
                                                  const ReportMore& more = {});

}  // namespace saccade
