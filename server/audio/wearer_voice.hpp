#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

namespace grpc {
class Channel;
}

namespace saccade {

struct WearerVoiceOptions {
  std::string capture;   // ALSA's name of the microphone; empty: the wearer does not speak
  std::string playback;  // of the loudspeaker; empty: the wearer hears nobody
  std::string token;     // with which it joins; empty: where nobody needs one
  std::string display_name = "wearer (voice)";
};

/// Voice of a wearable without a browser: microphone to the experts, the experts to the ear, by
/// ALSA. It takes part as everybody does, through the server's own calls. A device that goes
/// (unplugged) is opened again when it is back; what is wrong is said on the console once.
class WearerVoice {
 public:
  /// Opens what is named, so that a wrong name ends the start. Unavailable: as PcmDevice::Open.
  static absl::StatusOr<std::unique_ptr<WearerVoice>> Start(const WearerVoiceOptions& options,
                                                            std::shared_ptr<grpc::Channel> channel);
  /// Within half a second, whatever device or server do.
  ~WearerVoice();

 private:
  class Impl;
  explicit WearerVoice(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
