#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "server/anchors/frame_ring.hpp"

namespace saccade {

/// Where the camera was in each of the last frames, for choosing among them: to unpack a picture
/// takes a millisecond, and ten of three hundred are wanted.
class PoseTrail {
 public:
  struct Pose {
    FrameId id = 0;
    bool tracking = false;
    std::uint64_t map_generation = 0;
    Rigid3 world_from_camera;  // as published with that frame
  };
  void Add(const MapSnapshot& snapshot);
  /// Null if it is not among them.
  const Pose* Find(FrameId id) const;

 private:
  std::deque<Pose> poses_;  // by rising id
};

struct BesideOptions {
  FrameId stride = 1;    // frames between those that are considered
  std::size_t most = 0;  // that see it most from beside
  double least_parallax_px = 0, most_parallax_px = 0;
};

/// A frame that sees what was clicked from elsewhere.
struct BesideView {
  PastFrame past;
  Rigid3 view_from_clicked;
  double parallax_px = 0.0;  // of a point at the range asked for
};

/// The frames of the last seconds that see `bearing` (unit, in the clicked camera) at `range_m`
/// most from beside, the most so first. Without `trail`, every frame that is considered is looked
/// up.
std::vector<BesideView> ViewsFromBeside(const PastFrame& clicked, const Eigen::Vector3d& bearing,
                                        double range_m, FrameId newest, const FrameLookup& frames,
                                        const PoseTrail* trail, const BesideOptions& options);

}  // namespace saccade
