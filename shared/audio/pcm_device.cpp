#include "shared/audio/pcm_device.hpp"

#include <absl/strings/str_cat.h>
#include <alsa/asoundlib.h>

#include <mutex>

namespace saccade {
namespace {

constexpr unsigned kLatency_us = 80'000;  // of the device's own buffer

absl::Status Unavailable(const std::string& name, int error) {
  return absl::UnavailableError(absl::StrCat("audio device '", name, "': ", snd_strerror(error),
                                             "; `arecord -L` and `aplay -L` list what there is"));
}

void Ignore(const char*, int, const char*, int, const char*, ...) {}

// ALSA writes its own words to stderr; ours name what matters.
void Quiet() {
  static std::once_flag once;
  std::call_once(once, [] { snd_lib_error_set_handler(Ignore); });
}

}  // namespace

void PcmDevice::Close::operator()(_snd_pcm* pcm) const { snd_pcm_close(pcm); }

absl::StatusOr<PcmDevice> PcmDevice::Open(const std::string& name, Direction direction) {
  Quiet();
  snd_pcm_t* pcm = nullptr;
  const auto stream =
      direction == Direction::kCapture ? SND_PCM_STREAM_CAPTURE : SND_PCM_STREAM_PLAYBACK;
  if (const int error = snd_pcm_open(&pcm, name.c_str(), stream, SND_PCM_NONBLOCK); error < 0) {
    return Unavailable(name, error);
  }
  PcmDevice device(name, pcm);
  const int error =
      snd_pcm_set_params(pcm, SND_PCM_FORMAT_S16, SND_PCM_ACCESS_RW_INTERLEAVED,
                         /*channels=*/1, kVoiceRate_hz, /*soft_resample=*/1, kLatency_us);
  if (error < 0) return Unavailable(name, error);
  if (direction == Direction::kCapture) {
    if (const int started = snd_pcm_start(pcm); started < 0) return Unavailable(name, started);
  }
  return device;
}

template <typename Transfer>
absl::Status PcmDevice::Move(std::chrono::milliseconds limit, Transfer transfer) {
  const auto end = std::chrono::steady_clock::now() + limit;
  for (std::size_t done = 0; done < kVoiceSamples;) {
    const snd_pcm_sframes_t moved = transfer(done);
    if (moved > 0) {
      done += static_cast<std::size_t>(moved);
      continue;
    }
    if (moved < 0 && moved != -EAGAIN) {
      ++overruns_;
      const int error = snd_pcm_recover(pcm_.get(), static_cast<int>(moved), /*silent=*/1);
      if (error < 0) return Unavailable(name_, error);
      if (snd_pcm_stream(pcm_.get()) == SND_PCM_STREAM_CAPTURE) snd_pcm_start(pcm_.get());
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) {
      return absl::DeadlineExceededError(absl::StrCat("audio device '", name_, "': nothing moves"));
    }
    // A negative answer is looked at by the next transfer.
    snd_pcm_wait(pcm_.get(), static_cast<int>(left.count()));
  }
  return absl::OkStatus();
}

absl::Status PcmDevice::Read(VoiceFrame& frame, std::chrono::milliseconds limit) {
  return Move(limit, [&](std::size_t done) {
    return snd_pcm_readi(pcm_.get(), frame.data() + done, kVoiceSamples - done);
  });
}

absl::Status PcmDevice::Write(const VoiceFrame& frame, std::chrono::milliseconds limit) {
  return Move(limit, [&](std::size_t done) {
    return snd_pcm_writei(pcm_.get(), frame.data() + done, kVoiceSamples - done);
  });
}

}  // namespace saccade
