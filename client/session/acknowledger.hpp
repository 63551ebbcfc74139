#pragma once

#include <cstdint>
#include <optional>

#include "shared/time/timestamp.hpp"

namespace saccade::session {

/// When to tell the server how far this client has come. It is what bounds staleness, so it speaks
/// of what the decoder has kept up with; and it is the sign that somebody is there, so it speaks
/// now and then whatever happens. Pure; the caller locks and sends.
class Acknowledger {
 public:
  struct Message {
    std::uint64_t sequence = 0;
    bool request_key_frame = false;
  };

  explicit Acknowledger(std::uint64_t every, Timestamp now_ns) : every_(every), sent_ns_(now_ns) {}

  void Arrived(std::uint64_t sequence) { received_ = sequence; }
  void RequestKeyFrame() { key_frame_wanted_ = true; }
  /// What is to be sent now; nothing: nothing is due. `behind`: the decoder is.
  std::optional<Message> Due(Timestamp now_ns, bool behind);
  /// What became of it.
  void Sent(const Message& message, bool arrived);

 private:
  const std::uint64_t every_;
  std::uint64_t received_ = 0, acknowledged_ = 0;
  bool key_frame_wanted_ = false;
  Timestamp sent_ns_;
};

}  // namespace saccade::session
