#pragma once

#include <ctime>

#include "server/pipeline/stop_watch.hpp"

namespace saccade {

/// Time that one frame took, from the decoded image to the published pose.
struct FrameCost {
  double wall_ms = 0;
  double cpu_ms = 0;  // of the tracker's thread
};

/// CPU time of the calling thread [ms].
inline double ThreadCpuMs() {
  std::timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Measures from where it is made; on one thread.
class CostMeter {
 public:
  /// `waited_ms`: for other threads, which is nobody's cost.
  FrameCost Read(double waited_ms = 0.0) {
    return {watch_.Lap_ms() - waited_ms, ThreadCpuMs() - cpu_begin_ms_};
  }

 private:
  StopWatch watch_;
  const double cpu_begin_ms_ = ThreadCpuMs();
};

}  // namespace saccade
