#include "server/tracker/tracker.hpp"

#include "server/tracker/tracker_impl.hpp"

namespace saccade {

absl::StatusOr<std::unique_ptr<Tracker>> Tracker::Create(const SourceInfo& source,
                                                         const TrackerOptions& options) {
  if (const absl::Status status = options.Validate(); !status.ok()) return status;
  if (const absl::Status status = Starter::Check(source); !status.ok()) return status;
  return std::unique_ptr<Tracker>(new Tracker(std::make_unique<Impl>(source, options)));
}

Tracker::Tracker(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Tracker::~Tracker() = default;

std::shared_ptr<const MapSnapshot> Tracker::Track(const Frame& frame) {
  return impl_->Track(frame);
}

void Tracker::WaitForBackground() const { impl_->WaitForBackground(); }

void Tracker::Reset() { impl_->Reset(); }

absl::StatusOr<FeatureId> Tracker::SeedFeature(const Frame& clicked_frame,
                                               const Rigid3& world_from_camera,
                                               const Eigen::Vector2d& pixel, double depth_prior_m,
                                               double depth_sigma_m) {
  return impl_->SeedFeature(clicked_frame, world_from_camera, pixel, depth_prior_m, depth_sigma_m);
}

const TrackerOptions& Tracker::options() const { return impl_->options(); }

}  // namespace saccade
