#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <optional>

#include "server/eval/team/wand_files.hpp"

namespace saccade {

struct WandResult {
  CornerOrder order{};
  int reference = -1;  // the camera whose frame is the world
  Trajectory wand;     // world_from_wand, adjusted with all that was seen
  Trajectory online;   // each as it was known at its own instant, never revised
  std::map<int, Rigid3> world_from_camera;
  std::map<int, std::size_t> first_placed;  // instant at which each camera found its place
  WandFit fit;
};

/// Places cameras and wand from what they saw, instant by instant. Errors as FindCornerOrder;
/// FailedPrecondition: no camera ever saw the wand so that its pose is sure.
absl::StatusOr<WandResult> RunWand(const WandData& data);

/// Against references: the wand's errors after the SE3 alignment of its positions, and each
/// camera's by the same alignment.
struct WandScore {
  std::size_t poses = 0;
  double wand_rms_m = 0.0, online_rms_m = 0.0, wand_rms_deg = 0.0;
  std::map<int, std::pair<double, double>> cameras;  // [m], [deg]
};
/// Nothing without a reference of three poses.
std::optional<WandScore> ScoreWand(const WandData& data, const WandResult& result);

}  // namespace saccade
