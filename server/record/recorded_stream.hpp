#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>

#include "server/rpc/stream_hub.hpp"

namespace saccade {

/// One event of a stream, and when it came [ns, monotonic].
struct RecordedEvent {
  EncodedEvent event;
  Timestamp came_ns = 0;
  bool state = false;  // of the stream that begins anew again and again
};

/// Events on their way to the disk: bounded, by bytes. Who is full drops what comes. Thread safe.
class RecordQueue {
 public:
  explicit RecordQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void Push(RecordedEvent event);
  /// All there is, after at most `patience`.
  std::deque<RecordedEvent> TakeAll(std::chrono::milliseconds patience);
  void Wake();
  /// Since the start.
  std::uint64_t lost() const;

 private:
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<RecordedEvent> events_;
  std::size_t bytes_ = 0;
  std::uint64_t lost_ = 0;
  bool woken_ = false;
};

/// A participant of the hub who listens and never falls behind: takes every event at once.
class RecordedStream final : public Subscriber {
 public:
  RecordedStream(StreamHub& hub, Session session, const SubscriptionOptions& options, bool state,
                 std::shared_ptr<RecordQueue> queue)
      : Subscriber(std::move(session), options, hub.bytes()),
        hub_(hub),
        state_(state),
        queue_(std::move(queue)) {}

  void Pump() override;
  void Close(const absl::Status& /*status*/) override;
  void Abandon(const absl::Status& status) override { Close(status); }

 private:
  StreamHub& hub_;
  const bool state_;
  const std::shared_ptr<RecordQueue> queue_;
  bool closed_ = false;  // guarded by mutex_
};

}  // namespace saccade
