#pragma once

#include <deque>
#include <memory>
#include <mutex>

#include "shared/audio/voice_frame.hpp"

struct SpeexEchoState_;
struct SpeexPreprocessState_;

namespace saccade {

/// Takes out of the microphone what the loudspeaker beside it says (adaptive filter of 200 ms), and
/// steady noise. Thread safe: one thread plays, another captures.
class EchoCanceller {
 public:
  EchoCanceller();
  ~EchoCanceller();

  /// What the loudspeaker is given, in order; silence too. It is heard when as many frames as wait
  /// in the device's buffer have been captured.
  void Played(const VoiceFrame& frame);
  /// What the microphone heard, without it.
  VoiceFrame Captured(const VoiceFrame& frame);

 private:
  std::mutex mutex_;
  std::deque<VoiceFrame> played_;  // and not heard yet
  std::unique_ptr<SpeexEchoState_, void (*)(SpeexEchoState_*)> echo_;
  std::unique_ptr<SpeexPreprocessState_, void (*)(SpeexPreprocessState_*)> noise_;
};

}  // namespace saccade
