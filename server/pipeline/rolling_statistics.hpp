#pragma once

#include <cstddef>
#include <deque>
#include <mutex>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Values of the last `window_ns`: rate, sum per second, percentiles. Thread safe.
class RollingStatistics {
 public:
  explicit RollingStatistics(Timestamp window_ns = 2'000'000'000) : window_ns_(window_ns) {}

  void Add(Timestamp now_ns, double value);

  struct Summary {
    double rate_hz = 0;         // values a second
    double sum_per_second = 0;  // e.g. bits a second
    double p50 = 0, p95 = 0;    // 0 when empty
  };
  Summary At(Timestamp now_ns) const;

 private:
  struct Sample {
    Timestamp time_ns;
    double value;
  };
  const Timestamp window_ns_;
  mutable std::mutex mutex_;
  std::deque<Sample> samples_;
};

}  // namespace saccade
