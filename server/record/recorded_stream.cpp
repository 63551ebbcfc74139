#include "server/record/recorded_stream.hpp"

#include <chrono>
#include <utility>

namespace saccade {
namespace {

std::size_t SizeOf(const EncodedEvent& event) {
  return event.head.size() + (event.shared ? event.shared->size() : 0) + event.tail.size();
}

}  // namespace

void RecordQueue::Push(RecordedEvent event) {
  {
    const std::lock_guard lock(mutex_);
    const std::size_t size = SizeOf(event.event);
    if (bytes_ + size > most_bytes_) {
      ++lost_;
      return;
    }
    bytes_ += size;
    events_.push_back(std::move(event));
  }
  changed_.notify_one();
}

std::deque<RecordedEvent> RecordQueue::TakeAll(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return woken_ || !events_.empty(); });
  woken_ = false;
  bytes_ = 0;
  return std::exchange(events_, {});
}

void RecordQueue::Wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

std::uint64_t RecordQueue::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

void RecordedStream::Pump() {
  bool ask = false;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    const Timestamp now_ns = MonotonicNow();
    EncodedEvent event;
    while (subscription_.Next(now_ns, event)) {
      subscription_.Acknowledge(subscription_.last_sequence(), false, now_ns).IgnoreError();
      queue_->Push({std::exchange(event, {}), now_ns, state_});
    }
    ask = subscription_.WantsKeyFrame(now_ns);
  }
  if (ask) hub_.AskForKeyFrame(view());
}

void RecordedStream::Close(const absl::Status& /*status*/) {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

}  // namespace saccade
