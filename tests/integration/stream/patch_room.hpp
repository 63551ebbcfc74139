#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "server/capture/frame_source.hpp"
#include "server/tracker/frame_tracker.hpp"
#include "shared/geometry/similarity3.hpp"

namespace saccade::testing {

/// A room of textured patches that hang at different depths, cheap to draw: real pictures of one
/// place from anywhere in it.
class PatchRoom {
 public:
  explicit PatchRoom(std::uint64_t seed);
  cv::Mat Draw(const Rigid3& room_from_camera, const CameraModel& camera) const;
  const std::vector<Eigen::Vector3d>& points() const { return points_; }  // [m]

 private:
  std::vector<Eigen::Vector3d> points_;  // farthest first
  std::vector<cv::Mat> patches_;
};

/// Somebody who sways before the patches.
struct PatchWalk {
  double phase = 0.0, aside_m = 0.0;
  Rigid3 At(Timestamp time_ns) const;  // room_from_camera
};

/// What he sees, ten pictures a second.
std::unique_ptr<FrameSource> MakePatchSource(std::shared_ptr<const PatchRoom> room, PatchWalk walk);
/// A tracker that knows where he is, in a map that began elsewhere.
std::unique_ptr<FrameTracker> MakePatchTracker(std::shared_ptr<const PatchRoom> room,
                                               PatchWalk walk, Rigid3 map_from_room);

}  // namespace saccade::testing
