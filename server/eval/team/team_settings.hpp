#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "server/team/planar_robot.hpp"

namespace saccade {

/// `--set team.KEY=VALUE` of `saccade-eval team`.
struct TeamAway {
  int robot = 0;
  double from_s = 0, until_s = 0;  // since the recording began
};
struct TeamSettings {
  bool joint = true;           // mode: joint, or separate (nobody uses what he sees of the others)
  int landmarks = 0;           // only the first so many robots see landmarks; 0: all do
  bool start_by_truth = true;  // start: truth (placed where they stood), or sights
  std::vector<TeamAway> away;  // away: ROBOT:FROM:UNTIL, may be repeated
  double rate_hz = 10.0;       // poses written
  double hold_ms = 100.0;      // how long an event may be late
  double delay_ms = 0.0;       // events arrive up to so late, at random
  double loss = 0.0;           // share of sightings that never arrive
  int seed = 1;
  double tag_side_m = 0.0;  // of a wand; 0: as its file says
  PlanarOptions planar;
};

/// InvalidArgument names the key, its value and what it may be.
absl::StatusOr<TeamSettings> ParseTeamSettings(const std::vector<std::string>& set);
/// The keys, for --help.
std::string TeamSettingsHelp();

}  // namespace saccade
