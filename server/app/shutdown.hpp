#pragma once

#include <absl/status/status.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>

namespace saccade {

/// Ends the process within two seconds of SIGINT or SIGTERM, whatever its other threads do.
///
/// A thread of its own hears the signals. The first one asks the main thread to end in order; if it
/// has not after a grace period (a frame that takes minutes, a disk or a source that does not
/// answer), what was accepted is made durable, one line on stderr says so, and the process leaves
/// without the threads that hold it up. A second signal leaves at once.
class Shutdown {
 public:
  /// Blocks the signals in this thread and all that it starts later: first of all in main. The
  /// object lives as long as the process.
  static Shutdown& Listen();

  /// Waits for a signal, or until `run_for_s` has passed, which counts as one.
  void Wait(const std::optional<double>& run_for_s);
  bool requested() const;

  /// What the main thread is about, for the line on stderr: "opening the source". A literal.
  void SetPhase(const char* phase) { phase_ = phase; }
  /// Makes what was accepted durable, within the limit; called at most once, on the thread that
  /// hears signals. Null: there is nothing (any more). Waits for a call that has begun.
  using Commit = std::function<absl::Status(std::chrono::milliseconds limit)>;
  void SetCommit(Commit commit);

 private:
  Shutdown();
  void Run();
  [[noreturn]] void Leave(const char* why, std::chrono::milliseconds commit_limit);

  sigset_t signals_{};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool requested_ = false;  // guarded by mutex_
  std::mutex commit_mutex_;
  Commit commit_;  // guarded by commit_mutex_
  std::atomic<const char*> phase_ = "starting";
};

}  // namespace saccade
