#pragma once

#include <optional>

#include "server/eval/score.hpp"
#include "server/team/merge/map_joiner.hpp"

namespace saccade {

/// truth_from_map by a trajectory's own poses: rotation by orientations, scale and place by
/// positions. Where the way was short, positions alone say little of how the map is turned.
Similarity3 AlignPoses(const std::vector<PosePair>& pairs);

/// How far off a merge is: one map, aligned to truth by the similarity of its own poses, carries
/// the other's trajectory, and that is compared with truth. Root mean squares hold the other's own
/// errors too; what all its poses share is the merge's.
struct MergeError {
  std::size_t poses = 0;
  double off_m = 0, off_deg = 0;  // shared by all poses: mean of position and of rotation errors
  double rms_m = 0, rms_deg = 0;  // of single poses
  double sigma_m = 0;             // as the covariance has it, at the mean pose
  /// Where the maps meet: of each of the other's poses against the nearest of the aligned map's,
  /// within 0.5 m and 30 deg of it by truth. What either map is off elsewhere does not count.
  std::size_t seam_poses = 0;
  double seam_m = 0, seam_deg = 0;
};

/// `carrier`: of the map that is aligned; `carried`: of the other. Nothing with fewer than three
/// poses of either.
std::optional<MergeError> ScoreMerge(const std::vector<PosePair>& carrier,
                                     const std::vector<PosePair>& carried,
                                     const Similarity3& carrier_from_carried,
                                     const Matrix7d& covariance);

/// Smaller-to-larger spread of true positions decides which map is aligned: rms about their mean.
double TrueSpread(const std::vector<PosePair>& pairs);

}  // namespace saccade
