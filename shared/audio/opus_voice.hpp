#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "shared/audio/voice_frame.hpp"

struct OpusDecoder;
struct OpusEncoder;

namespace saccade {

/// Voice to Opus packets of 20 ms, 32 kbit/s.
class OpusVoiceEncoder {
 public:
  static absl::StatusOr<OpusVoiceEncoder> Create();
  /// Empty: silence, which need not be sent.
  std::string Encode(const VoiceFrame& frame);

 private:
  struct Destroy {
    void operator()(OpusEncoder* encoder) const;
  };
  explicit OpusVoiceEncoder(OpusEncoder* encoder) : encoder_(encoder) {}
  std::unique_ptr<OpusEncoder, Destroy> encoder_;
};

/// One speaker's packets back to voice.
class OpusVoiceDecoder {
 public:
  static absl::StatusOr<OpusVoiceDecoder> Create();
  /// InvalidArgument: no Opus of 20 ms; nothing is heard then.
  absl::Status Decode(const std::string& packet, VoiceFrame& frame);
  /// In place of a packet that did not come: what was last heard goes on and fades.
  void Conceal(VoiceFrame& frame);

 private:
  struct Destroy {
    void operator()(OpusDecoder* decoder) const;
  };
  explicit OpusVoiceDecoder(OpusDecoder* decoder) : decoder_(decoder) {}
  std::unique_ptr<OpusDecoder, Destroy> decoder_;
};

}  // namespace saccade
