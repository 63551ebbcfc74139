#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "saccade/v1/talk.pb.h"

namespace saccade {

/// What one speaker sent at once, on its way to those who listen.
struct VoiceBatch {
  std::string participant_id;
  std::vector<std::shared_ptr<const v1::VoicePacket>> packets;  // oldest first
};

/// What one subscriber has yet to hear. Bounded: of each speaker the newest half second, as who
/// hears it later would hear it too late. Not thread safe.
class VoiceQueue {
 public:
  static constexpr std::size_t kMaxPackets = 25;   // of a speaker, 20 ms each
  static constexpr std::size_t kMaxSpeakers = 16;  // that wait; who comes first is let in first

  void Push(const VoiceBatch& batch);
  /// All that waits of one speaker; speakers take turns. False: nothing does.
  bool Take(v1::VoiceEvent& event);
  /// Packets that were too old when they could have been sent.
  std::uint64_t skipped() const { return skipped_; }

 private:
  struct Speaker {
    std::string participant_id;
    std::deque<std::shared_ptr<const v1::VoicePacket>> packets;
  };
  std::deque<Speaker> waiting_;  // each has packets
  std::uint64_t skipped_ = 0;
};

}  // namespace saccade
