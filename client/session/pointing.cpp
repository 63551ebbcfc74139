#include "client/session/pointing.hpp"

#include <algorithm>

namespace saccade::session {
namespace {

constexpr Timestamp kCallNs = 1'000'000'000 / 60;  // pointer.proto
constexpr Timestamp kAwakeNs = 400'000'000;        // one that is silent for a second is gone
constexpr std::size_t kMostPoints = 64;            // pointer.proto

}  // namespace

void Pointing::Add(const AnnotationTarget& target) {
  if (ended_) return;
  waiting_.push_back(target);
  last_ = target;
}

std::optional<net::PointerWord> Pointing::Due(Timestamp now_ns) {
  if (in_flight_ || over_ || now_ns - sent_ns_ < kCallNs) return std::nullopt;
  if (waiting_.empty() && !ended_ && last_ && now_ns - sent_ns_ > kAwakeNs) {
    waiting_.push_back(*last_);
  }
  if (waiting_.empty() && !ended_) return std::nullopt;
  net::PointerWord word;
  word.stroke_id = stroke_id_;
  word.sketch = true;
  word.color_rgba = color_rgba_;
  const auto some = static_cast<std::ptrdiff_t>(std::min(waiting_.size(), kMostPoints));
  word.targets.assign(waiting_.begin(), waiting_.begin() + some);
  waiting_.erase(waiting_.begin(), waiting_.begin() + some);
  word.released = over_ = ended_ && waiting_.empty();
  in_flight_ = true;
  sent_ns_ = now_ns;
  return word;
}

}  // namespace saccade::session
