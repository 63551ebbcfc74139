#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "shared/audio/voice_frame.hpp"
#include "shared/audio/voice_mixer.hpp"

namespace saccade {

struct VoiceDeviceOptions {
  std::string capture;   // ALSA's name of the microphone; empty: none
  std::string playback;  // of the loudspeaker; empty: none
  /// Quieter frames (root mean square, 0 to 1) are silence, which is not sent half a second after
  /// the last loud one; 0: what Opus takes for silence alone.
  double sent_level = 0.0;
};

/// A microphone and a loudspeaker, with the echo of one taken out of the other. A device that goes
/// (unplugged) is opened again when it is back; what is wrong is logged once. Any thread.
class VoiceDevices {
 public:
  /// Opens what is named. Unavailable: as PcmDevice::Open.
  static absl::StatusOr<std::unique_ptr<VoiceDevices>> Start(const VoiceDeviceOptions& options);
  /// Within half a second, whatever the devices do.
  ~VoiceDevices();

  /// What is heard.
  VoiceMixer& mixer();
  /// False: muted. What is captured is dropped; its time is counted.
  void SetOpen(bool open);
  /// Waits for what was captured, the newest half second at the most; empty: told to stop.
  /// `capture_ns` is MonotonicNow()'s.
  std::vector<VoicePacket> Take(const std::stop_token& stop);
  /// When the microphone last heard something that is sent (MonotonicNow()); 0: never.
  Timestamp spoke_ns() const;
  /// What a device lacks, in words; empty: nothing.
  std::string problem() const;

 private:
  class Shared;
  class DeviceThread;
  VoiceDevices();
  std::shared_ptr<Shared> shared_;
  std::unique_ptr<DeviceThread> capture_, playback_;
};

}  // namespace saccade
