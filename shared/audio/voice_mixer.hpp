#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "shared/audio/jitter_buffer.hpp"
#include "shared/audio/opus_voice.hpp"
#include "shared/audio/voice_frame.hpp"

namespace saccade {

/// Everybody's voice for one loudspeaker. Thread safe.
class VoiceMixer {
 public:
  static constexpr std::size_t kMaxSpeakers = 16;

  /// `speaker`: which participant.
  void Hear(const std::string& speaker, const std::vector<VoicePacket>& packets, Timestamp now_ns);
  /// The next 20 ms of all together. False: nobody speaks, `frame` is silent.
  bool Mix(VoiceFrame& frame, Timestamp now_ns);
  /// Who was heard within the last `within_ns`, by participant.
  std::vector<std::string> Speaking(Timestamp now_ns, Timestamp within_ns) const;
  /// Nobody is heard any more: the connection is another one.
  void Clear();

 private:
  struct Speaker {
    OpusVoiceDecoder decoder;
    JitterBuffer buffer;
    Timestamp heard_ns = 0;
    Timestamp loud_ns = 0;
  };
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Speaker> speakers_;  // by participant
};

}  // namespace saccade
