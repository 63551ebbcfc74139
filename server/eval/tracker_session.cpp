#include "server/eval/tracker_session.hpp"

#include <absl/strings/str_cat.h>

#include "server/tracker/tracker.hpp"

namespace saccade {

absl::StatusOr<TrackerSession> MakeTrackerSession(const SourceInfo& info,
                                                  const TrackerArguments& arguments) {
  TrackerOptions options;
  if (!arguments.config.empty()) {
    if (const absl::Status status = options.LoadToml(arguments.config); !status.ok()) return status;
  }
  for (const std::string& pair : arguments.set) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos || equals == 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("--set '", pair, "' is not key=value, for example --set seed=2"));
    }
    const absl::Status status = options.Set(pair.substr(0, equals), pair.substr(equals + 1));
    if (!status.ok()) {
      return absl::Status(status.code(), absl::StrCat("--set ", pair, ": ", status.message()));
    }
  }
  absl::StatusOr<std::unique_ptr<Tracker>> created = Tracker::Create(info, options);
  if (!created.ok()) return created.status();
  const std::shared_ptr<Tracker> tracker = *std::move(created);
  TrackerSession session;
  session.track = [tracker](const Frame& frame) { return tracker->Track(frame); };
  session.seed = [tracker](const Frame& clicked_frame, const Rigid3& world_from_camera,
                           const Eigen::Vector2d& pixel, double depth_m, double sigma_m) {
    return tracker->SeedFeature(clicked_frame, world_from_camera, pixel, depth_m, sigma_m);
  };
  session.wait = [tracker] { tracker->WaitForBackground(); };
  return session;
}

}  // namespace saccade
