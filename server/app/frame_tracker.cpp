#include "server/app/frame_tracker.hpp"

namespace saccade {

std::shared_ptr<const MapSnapshot> NoTracker::Track(const Frame& frame) {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = frame.id;
  snapshot->capture_time_ns = frame.capture_time_ns;
  snapshot->advice = "this server only shows video";
  snapshot->map_generation = generation_;
  return snapshot;
}

absl::StatusOr<FeatureId> NoTracker::SeedFeature(const Frame& /*clicked_frame*/,
                                                 const Rigid3& /*world_from_camera*/,
                                                 const Eigen::Vector2d& /*pixel*/,
                                                 double /*depth_prior_m*/,
                                                 double /*depth_sigma_m*/) {
  return absl::FailedPreconditionError("this server only shows video");
}

}  // namespace saccade
