#include "server/tracker/refiner.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>

#include "server/pipeline/stop_watch.hpp"

namespace saccade {
namespace {

constexpr double kLongestDelay_s = 0.055;  // for an adjustment, where frames take longer
// An adjustment that moves the camera by more is told to the experts as a jump.
constexpr double kJumpShare = 0.02;
constexpr double kJumpAngle_rad = 0.02;

}  // namespace

Refiner::~Refiner() { Stop(); }

void Refiner::Stop() {
  if (!running_.valid()) return;
  stop_ = true;
  running_.get();
  stop_ = false;
}

void Refiner::Drop(FilterState& filter) {
  Stop();
  filter.DropCheckpoint();
}

void Refiner::Start(std::int64_t frame, Timestamp time_ns, const Map& map, FilterState& filter) {
  if (running_.valid()) return;
  auto job = map.MakeJob(filter);
  if (!job) return;
  started_ = frame;
  started_ns_ = time_ns;
  filter.SetCheckpoint();
  running_ = std::async(std::launch::async, [this, job = *std::move(job)]() mutable {
    // Late is no loss, but pictures and heartbeats are: what is live comes first.
    if (options_.adjust_live) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    std::optional<KeyframeGraph::Job> done;
    if (AdjustJob(job, stop_)) done = std::move(job);
    return done;
  });
}

void Refiner::Wait() const {
  if (running_.valid()) running_.wait();
}

bool Refiner::Finish(std::int64_t frame, Timestamp time_ns, double inverse_range, Map& map,
                     FilterState& filter) {
  waited_ms_ = 0.0;
  const bool due = frame >= started_ + options_.adjust_delay ||
                   Seconds(time_ns - started_ns_) >= kLongestDelay_s;
  if (!running_.valid() || !due) return false;
  if (options_.adjust_live &&
      running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return false;
  }
  StopWatch watch;
  const auto job = running_.get();
  waited_ms_ = watch.Lap_ms();
  if (!job) {
    filter.DropCheckpoint();
    return false;
  }
  const Rigid3 before = filter.camera().world_from_camera;
  map.Take(*job, filter);
  const Rigid3& after = filter.camera().world_from_camera;
  return (after.translation - before.translation).norm() * inverse_range > kJumpShare ||
         RotationAngle(before, after) > kJumpAngle_rad;
}

}  // namespace saccade
