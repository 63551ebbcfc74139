#include "server/capture/video/frame_queue.hpp"

#include <chrono>
#include <utility>

namespace saccade {
namespace {

constexpr Timestamp kStoodStill_ns = 2'000'000'000;  // behind by more: nothing is made up for

}  // namespace

bool FrameQueue::Put(Frame frame, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (pace_ == Pace::kNewest) {
    dropped_ += frames_.size();
    frames_.clear();
  } else {
    const auto room = [this] { return stopped_ || frames_.size() < most_; };
    if (!changed_.wait(lock, stop, room)) return false;
  }
  if (stopped_) return false;
  frames_.push_back(std::move(frame));
  changed_.notify_all();
  return true;
}

std::optional<Frame> FrameQueue::Take() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopped_ || ended_ || !frames_.empty(); });
    if (stopped_ || frames_.empty()) return std::nullopt;
    if (pace_ != Pace::kDue) break;
    const Timestamp now = MonotonicNow();
    if (!origin_ns_) origin_ns_ = now - frames_.front().capture_time_ns;
    while (frames_.size() > 1 && DueAt(frames_[1]) <= now) {
      frames_.pop_front();
      ++dropped_;
    }
    const Timestamp late = now - DueAt(frames_.front());
    if (late >= 0) {
      if (late > kStoodStill_ns) *origin_ns_ += late;
      break;
    }
    changed_.notify_all();  // room was made
    const std::chrono::steady_clock::time_point due{
        std::chrono::nanoseconds(DueAt(frames_.front()))};
    changed_.wait_until(lock, due, [this] { return stopped_; });
  }
  Frame frame = std::move(frames_.front());
  frames_.pop_front();
  changed_.notify_all();
  frame.received_time_ns = MonotonicNow();
  return frame;
}

void FrameQueue::End() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

void FrameQueue::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

bool FrameQueue::stopped() const {
  const std::lock_guard lock(mutex_);
  return stopped_;
}

std::uint64_t FrameQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

}  // namespace saccade
