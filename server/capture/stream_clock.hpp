#pragma once

#include <algorithm>
#include <optional>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Brings the times of a stream to the monotonic clock: the least delay between a picture's time
/// and its arrival is taken for the way's own. It is forgotten slowly, for clocks that drift.
class StreamClock {
 public:
  Timestamp ToMonotonic(Timestamp stream_ns, Timestamp received_ns) {
    const Timestamp delay = received_ns - stream_ns;
    least_ = least_ ? std::min(*least_ + kForget_ns, delay) : delay;
    return stream_ns + *least_;
  }
  void Reset() { least_.reset(); }

 private:
  static constexpr Timestamp kForget_ns = 3'000;  // a frame: 100 ppm at 30 fps
  std::optional<Timestamp> least_;
};

}  // namespace saccade
