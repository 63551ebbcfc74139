#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Puts what many devices send back into the order of exposure (slam-spec 11): an event waits until
/// one that is `hold_ns` younger has come. What comes later than that is counted and left out, so
/// that the result does not depend on the order of arrival. One thread.
template <typename Event>
class ReorderBuffer {
 public:
  explicit ReorderBuffer(Timestamp hold_ns = 100'000'000) : hold_ns_(hold_ns) {}

  /// `device` and `sequence` order events of the same time. False: too late, counted.
  bool Push(Timestamp time_ns, int device, std::size_t sequence, Event event) {
    if (time_ns < released_until_ns_) {
      ++late_;
      return false;
    }
    if (newest_ns_ < time_ns) newest_ns_ = time_ns;
    waiting_.emplace(Key{time_ns, device, sequence}, std::move(event));
    return true;
  }
  /// What need not wait any longer, in order. What is as old as the last event released, or older,
  /// is late from now on.
  std::vector<Event> Ready() { return Release(newest_ns_ - hold_ns_); }
  /// All that waits: nothing more will come.
  std::vector<Event> Rest() { return Release(newest_ns_ + 1); }

  std::size_t late() const { return late_; }
  std::size_t waiting() const { return waiting_.size(); }

 private:
  struct Key {
    Timestamp time_ns;
    int device;
    std::size_t sequence;
    auto operator<=>(const Key&) const = default;
  };

  /// Those before `end_ns`.
  std::vector<Event> Release(Timestamp end_ns) {
    std::vector<Event> ready;
    while (!waiting_.empty() && waiting_.begin()->first.time_ns < end_ns) {
      ready.push_back(std::move(waiting_.begin()->second));
      waiting_.erase(waiting_.begin());
    }
    if (end_ns > released_until_ns_) released_until_ns_ = end_ns;
    return ready;
  }

  Timestamp hold_ns_;
  Timestamp newest_ns_ = kNever, released_until_ns_ = kNever;
  static constexpr Timestamp kNever = -(Timestamp{1} << 62);
  std::map<Key, Event> waiting_;
  std::size_t late_ = 0;
};

}  // namespace saccade
