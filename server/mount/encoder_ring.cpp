#include "server/mount/encoder_ring.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr Timestamp kRateSpan = 30'000'000;  // less of it, and noise makes the rate

}  // namespace

bool EncoderRing::Add(const EncoderReading& reading) {
  if (!readings_.empty() && reading.time_ns <= readings_.back().time_ns) return false;
  readings_.push_back(reading);
  while (readings_.front().time_ns < reading.time_ns - span_ns_) readings_.pop_front();
  return true;
}

std::optional<EncoderReading> EncoderRing::Newest() const {
  if (readings_.empty()) return std::nullopt;
  return readings_.back();
}

std::optional<MountAngles> EncoderRing::At(Timestamp time_ns) const {
  if (readings_.empty() || time_ns < readings_.front().time_ns) return std::nullopt;
  if (time_ns > readings_.back().time_ns + max_gap_ns_) return std::nullopt;
  auto after = std::lower_bound(
      readings_.begin(), readings_.end(), time_ns,
      [](const EncoderReading& reading, Timestamp time) { return reading.time_ns < time; });
  if (after != readings_.end() && after->time_ns == time_ns) return after->angles;
  const EncoderReading* last = after == readings_.begin() ? &*after : &*(after - 1);
  const EncoderReading* next = last;
  if (after != readings_.end()) {
    next = &*after;
    if (next->time_ns - last->time_ns > max_gap_ns_) return std::nullopt;
  } else {
    for (auto back = readings_.rbegin(); back != readings_.rend(); ++back) {
      last = &*back;
      if (next->time_ns - last->time_ns >= kRateSpan) break;
    }
  }
  if (next == last) return last->angles;
  const double share = static_cast<double>(time_ns - last->time_ns) /
                       static_cast<double>(next->time_ns - last->time_ns);
  return ToAngles((1 - share) * ToVector(last->angles) + share * ToVector(next->angles));
}

}  // namespace saccade
