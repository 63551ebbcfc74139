#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

#include "saccade/v1/talk.pb.h"
#include "server/audio/jitter_buffer.hpp"
#include "server/audio/opus_voice.hpp"
#include "server/audio/voice_frame.hpp"

namespace saccade {

/// Everybody's voice for one loudspeaker. Thread safe.
class VoiceMixer {
 public:
  static constexpr std::size_t kMaxSpeakers = 16;

  void Hear(const v1::VoiceEvent& event, Timestamp now_ns);
  /// The next 20 ms of all together. False: nobody speaks, `frame` is silent.
  bool Mix(VoiceFrame& frame, Timestamp now_ns);
  /// Nobody is heard any more: the connection is another one.
  void Clear();

 private:
  struct Speaker {
    OpusVoiceDecoder decoder;
    JitterBuffer buffer;
    Timestamp heard_ns = 0;
  };
  std::mutex mutex_;
  std::unordered_map<std::string, Speaker> speakers_;  // by participant
};

}  // namespace saccade
