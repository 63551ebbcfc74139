#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "server/capture/stream_clock.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A phone's clock against the monotonic one: from pings as in NTP, the quickest of the last 16;
/// before the first, from the pictures' own arrival (StreamClock). What the phone says is never
/// believed beyond reason: no picture is from the future, nor older than two seconds on arrival.
class PhoneClock {
 public:
  /// One exchange: our pong left at `server_sent_ns` and came at `phone_arrived_ns`; their ping
  /// left at `phone_sent_ns` and came at `server_arrived_ns`.
  void Add(Timestamp server_sent_ns, Timestamp phone_arrived_ns, Timestamp phone_sent_ns,
           Timestamp server_arrived_ns);
  /// When a picture was taken. Rises from picture to picture, or nothing: it is none of ours.
  std::optional<Timestamp> ToMonotonic(Timestamp phone_ns, Timestamp received_ns);
  /// The same of anything else that the phone stamps; nothing before the first picture.
  std::optional<Timestamp> At(Timestamp phone_ns) const;
  /// For another phone; times rise on.
  void Reset();

 private:
  struct Sample {
    Timestamp offset_ns = 0, round_trip_ns = 0;
  };
  std::optional<Timestamp> measured_offset() const;

  std::array<Sample, 16> samples_{};
  std::size_t count_ = 0;
  StreamClock arrivals_;
  std::optional<Timestamp> offset_ns_;  // in use: follows what is measured, slowly
  bool was_measured_ = false;
  Timestamp last_ns_ = 0;
};

}  // namespace saccade
