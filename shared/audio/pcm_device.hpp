#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "shared/audio/voice_frame.hpp"

struct _snd_pcm;

namespace saccade {

/// A microphone or a loudspeaker by ALSA's name of it ("default", "plughw:1,0"; `arecord -L` and
/// `aplay -L` list them). ALSA converts where the device has other rates or channels. One thread.
class PcmDevice {
 public:
  enum class Direction { kCapture, kPlayback };

  /// Unavailable: names the device, ALSA's reason and what to try.
  static absl::StatusOr<PcmDevice> Open(const std::string& name, Direction direction);

  /// Waits for the next 20 ms.
  ///   DeadlineExceeded  the device moved nothing for `limit`; try again
  ///   Unavailable       it is gone (unplugged): open it again
  absl::Status Read(VoiceFrame& frame, std::chrono::milliseconds limit);
  /// Waits until there is room for 20 ms. Errors as Read.
  absl::Status Write(const VoiceFrame& frame, std::chrono::milliseconds limit);

  /// How often samples were lost or lacked since it was opened.
  std::int64_t overruns() const { return overruns_; }

 private:
  struct Close {
    void operator()(_snd_pcm* pcm) const;
  };
  PcmDevice(std::string name, _snd_pcm* pcm) : name_(std::move(name)), pcm_(pcm) {}
  template <typename Transfer>
  absl::Status Move(std::chrono::milliseconds limit, Transfer transfer);

  std::string name_;
  std::unique_ptr<_snd_pcm, Close> pcm_;
  std::int64_t overruns_ = 0;
};

}  // namespace saccade
