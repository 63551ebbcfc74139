#include "shared/audio/echo_canceller.hpp"

#include <speex/speex_echo.h>
#include <speex/speex_preprocess.h>

namespace saccade {
namespace {

constexpr int kTail = 10 * kVoiceSamples;  // samples, 200 ms: the devices' buffers and a room

constexpr std::size_t kMostWaiting = 10;  // frames: the two clocks have drifted apart

}  // namespace

EchoCanceller::EchoCanceller()
    : echo_(speex_echo_state_init(kVoiceSamples, kTail), speex_echo_state_destroy),
      noise_(speex_preprocess_state_init(kVoiceSamples, kVoiceRate_hz),
             speex_preprocess_state_destroy) {
  int rate = kVoiceRate_hz;
  speex_echo_ctl(echo_.get(), SPEEX_ECHO_SET_SAMPLING_RATE, &rate);
  speex_preprocess_ctl(noise_.get(), SPEEX_PREPROCESS_SET_ECHO_STATE, echo_.get());
}

EchoCanceller::~EchoCanceller() = default;

void EchoCanceller::Played(const VoiceFrame& frame) {
  const std::lock_guard lock(mutex_);
  played_.push_back(frame);
  if (played_.size() > kMostWaiting) played_.pop_front();
}

VoiceFrame EchoCanceller::Captured(const VoiceFrame& frame) {
  VoiceFrame clean, played{};
  const std::lock_guard lock(mutex_);
  if (!played_.empty()) {
    played = played_.front();
    played_.pop_front();
  }
  speex_echo_cancellation(echo_.get(), frame.data(), played.data(), clean.data());
  speex_preprocess_run(noise_.get(), clean.data());
  return clean;
}

}  // namespace saccade
