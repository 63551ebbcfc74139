#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "server/capture/frame.hpp"

namespace saccade {

/// How a queue of decoded frames is emptied.
enum class Pace {
  kEvery,  // every frame in order, as fast as they are asked for
  kDue,    // when due by its time stamp, the newest that is
  kNewest  // the newest there is; a live stream
};

/// Decoded frames between the thread that reads them and the one that asks. Thread safe.
class FrameQueue {
 public:
  FrameQueue(Pace pace, std::size_t most) : pace_(pace), most_(most) {}

  /// Waits for room, but for kNewest, which drops the older one. False if stopped.
  bool Put(Frame frame, const std::stop_token& stop);
  /// Waits for a frame, and until it is due; nothing once stopped, or at the end.
  std::optional<Frame> Take();
  /// No frame comes after those that are here.
  void End();
  void Stop();
  bool stopped() const;
  std::uint64_t dropped() const;

 private:
  Timestamp DueAt(const Frame& frame) const { return frame.capture_time_ns + *origin_ns_; }

  const Pace pace_;
  const std::size_t most_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Frame> frames_;  // guarded by mutex_, as what follows
  bool ended_ = false, stopped_ = false;
  std::uint64_t dropped_ = 0;
  std::optional<Timestamp> origin_ns_;  // kDue: steady clock minus the video's
};

}  // namespace saccade
