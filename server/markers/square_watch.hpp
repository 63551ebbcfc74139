#pragma once

#include <future>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "server/markers/marker_detector.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A detector on a thread of its own, so that it costs no frame its time. One thread calls.
class SquareWatch {
 public:
  struct Seen {
    Timestamp time_ns = 0;  // of the picture
    std::vector<MarkerSighting> sightings;
    double detector_ms = 0;  // of its core
    /// Of a picture without any, looked at now and then: how many its mirror image has.
    std::optional<std::size_t> mirrored = std::nullopt;
  };

  explicit SquareWatch(std::unique_ptr<MarkerDetector> detector) : detector_(std::move(detector)) {}
  ~SquareWatch() { Drop(); }
  SquareWatch(const SquareWatch&) = delete;
  SquareWatch& operator=(const SquareWatch&) = delete;

  bool looking() const { return running_.valid(); }
  /// Begins to look at a picture, which must not change; nothing while it looks at another.
  void Look(const cv::Mat& grey, Timestamp time_ns);
  /// What was seen; nothing if nothing is being looked at or, without `wait`, it is not done.
  std::optional<Seen> Take(bool wait);
  /// Forgets what it looks at.
  void Drop() { Take(/*wait=*/true); }
  void Wait() const {
    if (running_.valid()) running_.wait();
  }
  /// What Take() has waited last [ms].
  double waited_ms() const { return waited_ms_; }

 private:
  std::unique_ptr<MarkerDetector> detector_;
  std::future<Seen> running_;
  double waited_ms_ = 0;
  int empty_ = 0;  // pictures in a row; of the thread that looks
};

}  // namespace saccade
