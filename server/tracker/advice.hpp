#pragma once

#include <optional>
#include <string>

#include "server/tracker/status_monitor.hpp"

namespace saccade {

/// What the tracker sees of its wearer's difficulties.
struct Difficulties {
  bool waits_for_target = false;
  bool turns_followed = false;        // orientation is known, depth is not yet
  bool resumes = false;               // looks for a place mapped in an earlier run
  double speed_rad_s = 0.0;           // of the camera
  int in_view = 0;                    // landmarks that were found
  std::optional<double> too_few_hz;   // pictures a second, where more are needed
  std::optional<double> lens_growth;  // LensEvidence::Growth()
};

/// What the wearer can do about it, in words; empty if all is well.
std::string AdviceFor(const StatusMonitor& monitor, const Difficulties& seen);

}  // namespace saccade
