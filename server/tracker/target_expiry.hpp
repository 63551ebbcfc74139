#pragma once

#include "server/map/map.hpp"
#include "server/tracker/births.hpp"

namespace saccade {

/// The target leaves the map; what was seen of it in this frame stays as ordinary features, at the
/// depth that it gave. So scale does not rest on parallax alone if the wearer stood still at the
/// start.
void LetTargetGo(const Frame& frame, const FrameMatcher& matcher, FrontEnd& front_end,
                 Births& births, FrameMatches& matches, Map& map, FilterState& filter);

}  // namespace saccade
