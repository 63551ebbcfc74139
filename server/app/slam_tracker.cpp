#include "server/app/slam_tracker.hpp"

#include "server/tracker/tracker.hpp"

namespace saccade {
namespace {

class SlamTracker final : public FrameTracker {
 public:
  explicit SlamTracker(std::unique_ptr<Tracker> tracker) : tracker_(std::move(tracker)) {}

  std::shared_ptr<const MapSnapshot> Track(const Frame& frame) override {
    return tracker_->Track(frame);
  }
  void Reset() override { tracker_->Reset(); }
  absl::StatusOr<FeatureId> SeedFeature(const Frame& clicked_frame, const Rigid3& world_from_camera,
                                        const Eigen::Vector2d& pixel, double depth_prior_m,
                                        double depth_sigma_m) override {
    return tracker_->SeedFeature(clicked_frame, world_from_camera, pixel, depth_prior_m,
                                 depth_sigma_m);
  }

 private:
  const std::unique_ptr<Tracker> tracker_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameTracker>> MakeSlamTracker(const SourceInfo& source,
                                                              const TrackerOptions& options) {
  absl::StatusOr<std::unique_ptr<Tracker>> tracker = Tracker::Create(source, options);
  if (!tracker.ok()) return tracker.status();
  return std::make_unique<SlamTracker>(*std::move(tracker));
}

}  // namespace saccade
