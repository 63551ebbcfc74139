#pragma once

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Brings capture times to the monotonic clock. Live sources are on it already; a recording has a
/// clock of its own, and its frames count as captured at the latest possible moments that keep
/// their distances and lie before their arrival. A recording that stood still for seconds (no file
/// descriptor was free) goes on from where it was, and so does a live one whose clock was set. A
/// source that does not keep pace with any clock
/// (`paced` false: every frame as fast as it can) is captured when it arrives.
class FrameClock {
 public:
  explicit FrameClock(bool paced = true) : paced_(paced) {}

  /// `received_ns`: MonotonicNow() when the picture was complete.
  Timestamp ToMonotonic(Timestamp capture_ns, Timestamp received_ns) {
    if (!paced_) return received_ns;
    const Timestamp difference = received_ns - capture_ns;
    if (!offset_ns_) {
      const bool live = difference >= 0 && difference < kLiveNs;
      offset_ns_ = live ? 0 : difference;
      adapts_ = !live;
    }
    if (!adapts_ && (difference < -kLiveNs || difference > kClockSetNs)) {
      adapts_ = true;  // the camera's clock was set: from here on as a recording's
      offset_ns_ = difference;
    }
    if (adapts_) {
      const bool stood_still = difference - *offset_ns_ > kStoodStillNs;
      offset_ns_ = stood_still ? difference : std::min(*offset_ns_, difference);
    }
    return capture_ns + *offset_ns_;
  }

 private:
  static constexpr Timestamp kLiveNs = 1'000'000'000;
  static constexpr Timestamp kClockSetNs = 60'000'000'000;  // no live frame is so late
  static constexpr Timestamp kStoodStillNs = 2'000'000'000;
  const bool paced_;
  std::optional<Timestamp> offset_ns_;
  bool adapts_ = false;
};

}  // namespace saccade
