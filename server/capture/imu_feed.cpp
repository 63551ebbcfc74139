#include "server/capture/imu_feed.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr Timestamp kKept_ns = 10'000'000'000, kHeld_ns = 30'000'000;

}  // namespace

void ImuFeed::Add(const ImuSample& sample) {
  const std::lock_guard lock(mutex_);
  live_ = true;
  if (!samples_.empty() && sample.time_ns <= samples_.back().time_ns) return;
  samples_.push_back(sample);
  if (samples_.back().time_ns - samples_.front().time_ns < 2 * kKept_ns) return;
  const auto kept =
      std::ranges::lower_bound(samples_, sample.time_ns - kKept_ns, {}, &ImuSample::time_ns);
  samples_.erase(samples_.begin(), kept);
}

ImuTrack ImuFeed::Between(Timestamp from_ns, Timestamp to_ns) const {
  const std::lock_guard lock(mutex_);
  auto begin = std::ranges::upper_bound(samples_, from_ns, {}, &ImuSample::time_ns);
  auto end = std::ranges::lower_bound(samples_, to_ns, {}, &ImuSample::time_ns);
  if (begin != samples_.begin()) --begin;
  if (end != samples_.end()) ++end;
  ImuTrack track;
  if (begin < end) track.assign(begin, end);
  if (live_ && !track.empty() && track.back().time_ns < to_ns &&
      to_ns - track.back().time_ns <= kHeld_ns) {
    track.push_back(track.back());
    track.back().time_ns = to_ns;
  }
  return track;
}

}  // namespace saccade
