#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>

#include "server/capture/frame_source.hpp"
#include "server/tracker/frame_tracker.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Follows one camera through a place that it maps at the same time (EKF SLAM).
///
/// Frame in, snapshot out; one thread at a time. Deterministic for one seed. Losing track is a
/// state of the snapshot, never an error.
class Tracker final : public FrameTracker {
 public:
  /// `source`: the camera (never null) and, if the place has one, its target and start pose.
  /// InvalidArgument: options out of range, no camera, a target that cannot be used.
  static absl::StatusOr<std::unique_ptr<Tracker>> Create(const SourceInfo& source,
                                                         const TrackerOptions& options);
  ~Tracker() override;
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// Never null. Frames come in the order of their capture times; one that is not newer than the
  /// last, or not of the camera's size, changes nothing but the snapshot's frame id. After a gap of
  /// more than a second, or where the clock was set back by more, tracking starts anew: in the map,
  /// if it recognises it. The cost of a frame does not depend on the gap.
  std::shared_ptr<const MapSnapshot> Track(const Frame& frame) override;

  /// Returns when nothing is being computed on other threads (for a process that forks).
  void WaitForBackground() const;

  /// Throws the map away; the next frame starts anew (with the target, where there is one in view).
  void Reset() override;

  /// Starts a feature at something seen in an earlier frame, typically clicked by an expert.
  ///
  /// `clicked_frame` [kept by the caller] with the pose that it was published with; `pixel` in it
  /// [px, distorted]; depth along the optical axis of that camera, mean and sigma [m]. The patch is
  /// looked for in the newest tracked frame; the feature starts there with that depth.
  ///   FailedPrecondition  not tracking, or the map is full of better features
  ///   InvalidArgument     pixel or depth not usable
  ///   NotFound            the patch is not seen in the newest frame, or has no texture
  absl::StatusOr<FeatureId> SeedFeature(const Frame& clicked_frame, const Rigid3& world_from_camera,
                                        const Eigen::Vector2d& pixel, double depth_prior_m,
                                        double depth_sigma_m) override;

  const TrackerOptions& options() const;

 private:
  class Impl;
  explicit Tracker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
