#pragma once

#include <cstdint>
#include <string>

#include "shared/geometry/rigid3.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Where a square marker that moves is: x right, y up, z towards who looks at it, origin in its
/// middle.
struct MarkerPose {
  std::string family;
  std::uint32_t id = 0;
  Rigid3 world_from_marker;
  Timestamp seen_ns = 0;  // of the frame that showed it last
};

}  // namespace saccade
