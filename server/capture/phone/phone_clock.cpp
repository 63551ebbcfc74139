#include "server/capture/phone/phone_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace saccade {
namespace {

constexpr Timestamp kSlew_ns =
    200'000;  // a picture: a better measurement must not look like motion
constexpr Timestamp kJump_ns = 100'000'000;      // further off: the phone's clock was set
constexpr Timestamp kOldest_ns = 2'000'000'000;  // on arrival
constexpr Timestamp kLongestTrip_ns = 10'000'000'000;
constexpr Timestamp kMostPhone_ns = 4'000'000'000'000'000'000;  // no clock is beyond: 2096

bool Plausible(Timestamp phone_ns) { return phone_ns > 0 && phone_ns < kMostPhone_ns; }

}  // namespace

void PhoneClock::Add(Timestamp server_sent_ns, Timestamp phone_arrived_ns, Timestamp phone_sent_ns,
                     Timestamp server_arrived_ns) {
  if (!Plausible(phone_arrived_ns) || !Plausible(phone_sent_ns)) return;
  const Timestamp round_trip_ns =
      (server_arrived_ns - server_sent_ns) - (phone_sent_ns - phone_arrived_ns);
  if (round_trip_ns < 0 || round_trip_ns > kLongestTrip_ns) return;
  const Timestamp there = server_sent_ns - phone_arrived_ns;
  const Timestamp back = server_arrived_ns - phone_sent_ns;
  samples_[count_++ % samples_.size()] = {there + (back - there) / 2, round_trip_ns};
}

std::optional<Timestamp> PhoneClock::measured_offset() const {
  const auto end =
      samples_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, samples_.size()));
  if (end == samples_.begin()) return std::nullopt;
  return std::min_element(
             samples_.begin(), end,
             [](const Sample& a, const Sample& b) { return a.round_trip_ns < b.round_trip_ns; })
      ->offset_ns;
}

std::optional<Timestamp> PhoneClock::ToMonotonic(Timestamp phone_ns, Timestamp received_ns) {
  if (!Plausible(phone_ns)) return std::nullopt;
  const Timestamp by_arrival = arrivals_.ToMonotonic(phone_ns, received_ns) - phone_ns;
  const std::optional<Timestamp> measured = measured_offset();
  const Timestamp wanted = measured.value_or(by_arrival);
  // From one measurement to a better one; whatever is taken for one before the first is far off.
  const bool near = was_measured_ && std::abs(wanted - *offset_ns_) < kJump_ns;
  was_measured_ = measured.has_value();
  offset_ns_ = near ? *offset_ns_ + std::clamp(wanted - *offset_ns_, -kSlew_ns, kSlew_ns) : wanted;
  const Timestamp time_ns =
      std::clamp(phone_ns + *offset_ns_, received_ns - kOldest_ns, received_ns);
  if (time_ns <= last_ns_) return std::nullopt;
  last_ns_ = time_ns;
  return time_ns;
}

std::optional<Timestamp> PhoneClock::At(Timestamp phone_ns) const {
  if (!offset_ns_ || !Plausible(phone_ns)) return std::nullopt;
  return phone_ns + *offset_ns_;
}

void PhoneClock::Reset() {
  const Timestamp last_ns = last_ns_;
  *this = PhoneClock();
  last_ns_ = last_ns;
}

}  // namespace saccade
