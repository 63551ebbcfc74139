#pragma once

#include <absl/status/status.h>

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "server/pipeline/busy.hpp"

namespace saccade {

/// What a stage's queue does when it is full.
enum class WhenFull {
  kDropOldest,  // video: the newest matters
  kRefuse,      // requests: the caller is told
};

struct RunnerOptions {
  std::size_t capacity = 1;  // items that may wait
  WhenFull when_full = WhenFull::kDropOldest;
  bool inline_step = false;  // tests: Post runs the step itself, no thread
};

/// Runs a stage: a bounded queue and the one thread that calls `step` for each item, in order.
/// The thread ends, and items still waiting are dropped, when the runner is destroyed or stopped.
template <typename In>
class Runner {
 public:
  Runner(const RunnerOptions& options, std::function<void(In)> step)
      : options_(options), step_(std::move(step)) {
    if (!options_.inline_step) {
      thread_ = std::jthread([this](std::stop_token stop) { Loop(stop); });
    }
  }
  ~Runner() { Stop(); }

  /// ResourceExhausted: full and kRefuse. Never blocks (but for inline_step).
  absl::Status Post(In item) {
    if (options_.inline_step) {
      step_(std::move(item));
      return absl::OkStatus();
    }
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return absl::UnavailableError("the stage has stopped");
      if (queue_.size() >= options_.capacity) {
        if (options_.when_full == WhenFull::kRefuse) {
          return BusyError("the stage is busy", 200'000'000);
        }
        queue_.pop_front();
        ++dropped_;
      }
      queue_.push_back(std::move(item));
    }
    changed_.notify_one();
    return absl::OkStatus();
  }

  /// Waits for the step that runs, then ends the thread. Not from within the step.
  void Stop() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
  }

  std::size_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  void Loop(std::stop_token stop) {
    while (true) {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return !queue_.empty(); })) return;
      if (stop.stop_requested()) return;
      In item = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      step_(std::move(item));
    }
  }

  const RunnerOptions options_;
  const std::function<void(In)> step_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<In> queue_;
  std::size_t dropped_ = 0;
  bool stopped_ = false;
  std::jthread thread_;  // last: the loop uses everything above
};

}  // namespace saccade
