#pragma once

#include <optional>

#include "server/anchors/beside_views.hpp"

namespace saccade {

struct ProbedDepth {
  double range_m = 0.0;  // from the clicked camera along the clicked ray
  double sigma_m = 0.0;
  double score = 0.0;  // mean correlation over the views
  int views = 0;
};

/// How far away what was clicked is, by looking at it: the patch around `pixel` of the clicked
/// frame is compared, for many ranges about `guess_m`, with where it would show in other frames of
/// the last seconds, seen from beside (plane sweep, Collins 1996; facing the camera).
///
/// Nothing if the patch has no texture, the camera did not move sideways, or no single range stands
/// out. Uses the poses that the tracker published with each frame. Any thread.
std::optional<ProbedDepth> ProbeDepth(const PastFrame& clicked, const Eigen::Vector2d& pixel,
                                      double guess_m, FrameId newest, const FrameLookup& frames,
                                      const PoseTrail* trail = nullptr);

/// Joins it with an earlier estimate: the weighted mean if both agree, else the probe alone.
void JoinDepth(const ProbedDepth& probed, double& range_m, double& sigma_m);

}  // namespace saccade
