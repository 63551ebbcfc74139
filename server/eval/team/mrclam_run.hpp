#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <vector>

#include "server/eval/team/mrclam_files.hpp"
#include "server/eval/team/team_settings.hpp"
#include "server/team/planar_team.hpp"

namespace saccade {

/// What the team believed at one time, from nothing later than that; never revised.
struct MrclamPose {
  Timestamp time_ns = 0;
  PlanarTeam::Belief belief;
};
struct MrclamResult {
  std::vector<std::vector<MrclamPose>> robots;  // in the order of the data
  PlanarCounts counts;
  std::size_t late = 0, lost = 0;  // events that came too late; sightings that never came
};

/// Runs the team through a recording. Truth is read for the start poses only, if the settings say
/// so. InvalidArgument: a robot of team.away that there is not.
absl::StatusOr<MrclamResult> RunMrclam(const MrclamData& data, const TeamSettings& settings);

/// Errors of one robot against truth, where there is truth within 0.3 s on both sides.
struct MrclamScore {
  std::size_t poses = 0, compared = 0;
  double sum_m2 = 0.0, sum_rad2 = 0.0, worst_m = 0.0,
         sum_nees = 0.0;  // of the compared; NEES of x, y
};
MrclamScore ScoreMrclam(const std::vector<MrclamPose>& poses,
                        const std::vector<MrclamTruth>& truth);

}  // namespace saccade
