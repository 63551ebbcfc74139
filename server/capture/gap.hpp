#pragma once

#include "shared/time/timestamp.hpp"

namespace saccade {

/// The longest time between two pictures over which the camera's motion can be carried on. Beyond,
/// or where the clock was set back by more, nobody knows where the camera went: tracking starts
/// anew, at the cost of one frame however long the gap is.
inline constexpr Timestamp kLongestGap_ns = 1'000'000'000;

/// Whether two capture times in a row are further apart than kLongestGap_ns, either way.
inline bool IsGap(Timestamp before_ns, Timestamp after_ns) {
  const Timestamp longest = after_ns > before_ns ? after_ns - before_ns : before_ns - after_ns;
  return longest > kLongestGap_ns;
}

}  // namespace saccade
