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
    if (const absl::Status status = options.SetPair(pair); !status.ok()) return status;
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
