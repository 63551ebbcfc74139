#include "client/session/acknowledger.hpp"

namespace saccade::session {
namespace {

// The server ends a stream that acknowledges nothing for 30 s.
constexpr Timestamp kAtLatestNs = 2'000'000'000;
constexpr Timestamp kBehindAtLatestNs = 6'000'000'000;
constexpr Timestamp kFewNs = 100'000'000;  // fewer than `every` wait no longer than this

}  // namespace

std::optional<Acknowledger::Message> Acknowledger::Due(Timestamp now_ns, bool behind) {
  const Timestamp silent_ns = now_ns - sent_ns_;
  const std::uint64_t news = received_ - acknowledged_;
  bool due = news >= every_ || (news > 0 && silent_ns >= kFewNs) || silent_ns >= kAtLatestNs;
  if (behind) due = silent_ns >= kBehindAtLatestNs;
  due = due && received_ > 0;
  if (!due && !key_frame_wanted_) return std::nullopt;
  sent_ns_ = now_ns;
  const Message message{due ? received_ : acknowledged_, key_frame_wanted_};
  key_frame_wanted_ = false;
  return message;
}

void Acknowledger::Sent(const Message& message, bool arrived) {
  if (arrived) {
    acknowledged_ = message.sequence;
  } else {
    key_frame_wanted_ = key_frame_wanted_ || message.request_key_frame;
  }
}

}  // namespace saccade::session
