#include "client/session/clock.hpp"

#include <algorithm>

namespace saccade::session {

void ClockOffset::Add(const net::PingTimes& t) {
  samples_.push_back({((t.received_ns - t.sent_ns) + (t.replied_ns - t.answered_ns)) / 2,
                      (t.answered_ns - t.sent_ns) - (t.replied_ns - t.received_ns)});
  if (samples_.size() > 16) samples_.pop_front();
}

const ClockOffset::Sample* ClockOffset::Best() const {
  const auto best = std::min_element(
      samples_.begin(), samples_.end(),
      [](const Sample& a, const Sample& b) { return a.round_trip_ns < b.round_trip_ns; });
  return best == samples_.end() ? nullptr : &*best;
}

std::optional<Timestamp> ClockOffset::offset_ns() const {
  const Sample* best = Best();
  return best == nullptr ? std::nullopt : std::optional(best->offset_ns);
}

std::optional<Timestamp> ClockOffset::round_trip_ns() const {
  const Sample* best = Best();
  return best == nullptr ? std::nullopt : std::optional(best->round_trip_ns);
}

}  // namespace saccade::session
