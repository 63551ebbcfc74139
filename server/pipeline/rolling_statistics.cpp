#include "server/pipeline/rolling_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {
namespace {

// Nearest rank; `values` is reordered.
double Percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0.0;
  const auto rank =
      static_cast<std::ptrdiff_t>(std::lround(fraction * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

void RollingStatistics::Add(Timestamp now_ns, double value) {
  const std::lock_guard lock(mutex_);
  samples_.push_back({now_ns, value});
  while (samples_.front().time_ns < now_ns - window_ns_) samples_.pop_front();
}

RollingStatistics::Summary RollingStatistics::At(Timestamp now_ns) const {
  std::vector<double> values;
  {
    const std::lock_guard lock(mutex_);
    for (const Sample& sample : samples_) {
      if (sample.time_ns >= now_ns - window_ns_) values.push_back(sample.value);
    }
  }
  Summary summary;
  for (const double value : values) summary.sum_per_second += value;
  const double window_s = Seconds(window_ns_);
  summary.sum_per_second /= window_s;
  summary.rate_hz = static_cast<double>(values.size()) / window_s;
  summary.p50 = Percentile(values, 0.50);
  summary.p95 = Percentile(values, 0.95);
  return summary;
}

}  // namespace saccade
