#pragma once

#include <atomic>
#include <future>
#include <optional>

#include "server/filter/filter_state.hpp"
#include "server/map/map.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Bundle adjustment beside the filter: keyframes are adjusted on another core, and what comes out
/// is put into map and filter a fixed number of frames later.
///
/// All calls from the tracker's thread; the adjustment itself runs on one of its own and sees a
/// copy. A result is taken `adjust_delay` frames after its start; if it is not there yet, the
/// offline evaluation waits for it (results repeat to the bit), the live server looks again in the
/// next frame.
class Refiner {
 public:
  explicit Refiner(const TrackerOptions& options) : options_(options) {}
  ~Refiner();
  Refiner(const Refiner&) = delete;
  Refiner& operator=(const Refiner&) = delete;

  /// A running adjustment is stopped and dropped: the map was thrown away.
  void Reset() { Stop(); }
  /// The same, and the filter need not keep its checkpoint for it: the camera was lost, or the map
  /// moved.
  void Drop(FilterState& filter);
  /// Starts an adjustment around the newest keyframe, if none is running.
  void Start(std::int64_t frame, Timestamp time_ns, const Map& map, FilterState& filter);
  /// Puts a finished one into map and filter. True: the camera jumped by it, seen against the
  /// distance to what is in view.
  bool Finish(std::int64_t frame, Timestamp time_ns, double inverse_range, Map& map,
              FilterState& filter);
  /// Returns when no adjustment is being computed any more.
  void Wait() const;
  /// What Finish() has waited in this frame [ms].
  double waited_ms() const { return waited_ms_; }

 private:
  void Stop();

  TrackerOptions options_;
  std::atomic<bool> stop_ = false;
  std::future<std::optional<KeyframeGraph::Job>> running_;
  std::int64_t started_ = 0;  // frame
  Timestamp started_ns_ = 0;
  double waited_ms_ = 0.0;
};

}  // namespace saccade
