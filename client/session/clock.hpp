#pragma once

#include <deque>
#include <optional>

#include "client/net/stream.hpp"

namespace saccade::session {

/// Offset of the server's clock from this machine's, from pings as in NTP: the quickest of the last
/// 16. One thread.
class ClockOffset {
 public:
  void Add(const net::PingTimes& times);
  void Reset() { samples_.clear(); }
  /// Server time = MonotonicNow() + this [ns]; nothing before the first ping.
  std::optional<Timestamp> offset_ns() const;
  std::optional<Timestamp> round_trip_ns() const;

 private:
  struct Sample {
    Timestamp offset_ns = 0, round_trip_ns = 0;
  };
  const Sample* Best() const;

  std::deque<Sample> samples_;
};

}  // namespace saccade::session
