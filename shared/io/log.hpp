#pragma once

#include <absl/strings/string_view.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace saccade {

/// Lines to one file descriptor that never make the caller wait: a bounded queue, drained by a
/// thread of its own. When whoever reads is too slow, lines are dropped and counted, and the count
/// is written once there is room again. Any thread may write.
class LineWriter {
 public:
  /// `descriptor` stays the caller's and open; `most_bytes` may wait.
  explicit LineWriter(int descriptor, std::size_t most_bytes = std::size_t{1} << 20);
  /// Drops what still waits.
  ~LineWriter();

  /// One line, however long and whatever it holds: control characters are written as \xHH, and
  /// what is beyond 4000 bytes is cut with "...".
  void Write(absl::string_view line);

  /// Waits until all is written, at most `limit`; false if something is left.
  bool Flush(std::chrono::milliseconds limit);
  std::uint64_t dropped() const;

 private:
  void Run(const std::stop_token& stop);
  void WriteOut(absl::string_view text, const std::stop_token& stop) const;

  const int descriptor_;
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_, drained_;
  std::deque<std::string> queue_;  // guarded by mutex_, as what follows
  std::size_t bytes_ = 0;
  bool busy_ = false;
  std::uint64_t dropped_ = 0, untold_ = 0;
  std::jthread thread_;  // last: uses everything above; absent if the system gave none
};

/// One line on stderr, or on stdout. Neither ever waits for whoever reads them.
void Log(absl::string_view line);
void Announce(absl::string_view line);
/// Waits until both are written, at most `limit`. Also done at exit(), for a fifth of a second.
bool FlushLog(std::chrono::milliseconds limit);

/// Makes writes of libraries to stderr and stdout fail instead of wait where those are pipes or
/// terminals that nobody reads. Others who share them keep theirs as they are. Once, at the start.
void NeverWaitForStandardStreams();

/// `text` with every byte that is not printable ASCII, and the backslash, as \xHH: for words of
/// others in a line that people and programs trust.
std::string Printable(absl::string_view text);

}  // namespace saccade
