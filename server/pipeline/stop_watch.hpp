#pragma once

#include <chrono>

namespace saccade {

/// Time since it was made or last asked.
class StopWatch {
 public:
  double Lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double lap = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return lap;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace saccade
