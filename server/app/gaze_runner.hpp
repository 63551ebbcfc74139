#pragma once

#include <absl/container/flat_hash_set.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/gaze/gaze_loop.hpp"
#include "server/pipeline/gaze_commands.hpp"

namespace saccade {

/// The gaze thread: steps a GazeLoop a hundred times a second by the monotonic clock, carries out
/// commands as they come, and tells `publish` the state after each command and up to 30 times a
/// second. Everything public may be called from any thread.
class GazeRunner {
 public:
  using Publish = std::function<void(const std::shared_ptr<const GazeSnapshot>&)>;

  GazeRunner(std::shared_ptr<Mount> mount, const GazeOptions& options, std::size_t mailbox,
             Publish publish);
  ~GazeRunner() { Stop(); }

  void Start();
  /// Stops the head, ends the thread and answers every command. May be called twice.
  void Stop();

  /// ResourceExhausted: the mailbox is full. Unavailable: stopped. `done` is not called then.
  absl::Status Submit(GazeCommand command);
  /// The newest view counts; one that was not looked at yet is replaced.
  void OnView(GazeView view);
  std::shared_ptr<const GazeSnapshot> snapshot() const;
  /// Who has a stream open, by participant_id; never null.
  void SetPresence(std::shared_ptr<const absl::flat_hash_set<std::string>> present);

 private:
  void Run(std::stop_token stop);
  /// Whatever waits, at most until `until`.
  /// A heartbeat counts from when it came, however late this thread gets to it.
  struct Arrived {
    Timestamp time_ns;
    GazeCommand command;
  };
  struct Work {
    std::deque<Arrived> commands;
    std::optional<GazeView> view;
  };
  Work WaitFor(std::chrono::steady_clock::time_point until, std::stop_token stop);
  void Tell(bool changed);

  const std::shared_ptr<Mount> mount_;
  const std::size_t mailbox_;
  const Publish publish_;
  GazeLoop loop_;  // gaze thread
  Timestamp told_ns_ = 0;
  bool untold_ = false;  // a command changed something that nobody was told yet
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Arrived> commands_;
  std::optional<GazeView> view_;
  std::shared_ptr<const GazeSnapshot> newest_;
  std::shared_ptr<const absl::flat_hash_set<std::string>> present_;  // null: not told yet
  bool stopped_ = false;
  std::jthread thread_;  // last: it uses everything above
};

}  // namespace saccade
