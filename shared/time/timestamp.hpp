#pragma once

#include <chrono>
#include <cstdint>

namespace saccade {

/// Nanoseconds on the capture clock (monotonic). Stamped at mid-exposure, carried to the last
/// pixel.
using Timestamp = std::int64_t;

/// Now on the clock that live sources stamp with: std::chrono::steady_clock.
inline Timestamp MonotonicNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

inline double Seconds(Timestamp duration_ns) { return static_cast<double>(duration_ns) * 1e-9; }

}  // namespace saccade
