#include "server/markers/square_watch.hpp"

#include <chrono>

#include "server/pipeline/frame_cost.hpp"
#include "server/pipeline/stop_watch.hpp"

namespace saccade {
namespace {

constexpr int kMirrorEvery = 4;  // pictures without a square

}  // namespace

void SquareWatch::Look(const cv::Mat& grey, Timestamp time_ns) {
  if (running_.valid()) return;
  running_ = std::async(std::launch::async, [this, detector = detector_.get(), grey, time_ns] {
    const double begin_ms = ThreadCpuMs();
    Seen seen{time_ns, detector->Detect(grey), 0.0};
    empty_ = seen.sightings.empty() ? empty_ + 1 : 0;
    if (empty_ % kMirrorEvery == kMirrorEvery - 1) {
      seen.mirrored = CountIfMirrored(*detector, grey);
    }
    seen.detector_ms = ThreadCpuMs() - begin_ms;
    return seen;
  });
}

std::optional<SquareWatch::Seen> SquareWatch::Take(bool wait) {
  waited_ms_ = 0;
  if (!running_.valid()) return std::nullopt;
  if (!wait && running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return std::nullopt;
  }
  StopWatch watch;
  Seen seen = running_.get();
  waited_ms_ = watch.Lap_ms();
  return seen;
}

}  // namespace saccade
