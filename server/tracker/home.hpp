#pragma once

#include <optional>

#include "server/filter/filter_state.hpp"
#include "server/tracker/frame_matcher.hpp"

namespace saccade {

struct HomeOptions {
  double least_share = 0.1;  // of what is in view, seen from home or before; 0: home never moves
  double loose_tie_rad = 0.005;  // of what is in view to the clone that errors are counted from
};

/// Where errors should be counted from (docs/derivations/gauge.md): from where the camera is, not
/// from where it once began. A clone, the one in the middle of those that what is in view hangs on,
/// once hardly any of it was seen from `home` or before, or once its direction is only loosely tied
/// to home (back at old places, or at woken ones). Nothing: home stays; also while a point of the
/// target is in view, which is the world.
std::optional<CloneId> WantedHome(const FrameMatches& matches, const FilterState& filter,
                                  CloneId home, const HomeOptions& options);

}  // namespace saccade
