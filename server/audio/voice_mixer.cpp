#include "server/audio/voice_mixer.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace saccade {
namespace {

constexpr Timestamp kForgotten_ns = 10'000'000'000;

}  // namespace

void VoiceMixer::Hear(const v1::VoiceEvent& event, Timestamp now_ns) {
  const std::lock_guard lock(mutex_);
  auto speaker = speakers_.find(event.participant_id());
  if (speaker == speakers_.end()) {
    if (speakers_.size() >= kMaxSpeakers) return;
    absl::StatusOr<OpusVoiceDecoder> decoder = OpusVoiceDecoder::Create();
    if (!decoder.ok()) return;
    speaker = speakers_.emplace(event.participant_id(), Speaker{*std::move(decoder), {}, 0}).first;
  }
  speaker->second.heard_ns = now_ns;
  for (const v1::VoicePacket& packet : event.packets()) {
    speaker->second.buffer.Push(packet.sequence(), packet.opus(), now_ns);
  }
}

bool VoiceMixer::Mix(VoiceFrame& frame, Timestamp now_ns) {
  std::array<std::int32_t, kVoiceSamples> sum{};
  bool any = false;
  const std::lock_guard lock(mutex_);
  std::erase_if(speakers_,
                [&](const auto& each) { return now_ns - each.second.heard_ns > kForgotten_ns; });
  for (auto& [id, speaker] : speakers_) {
    const JitterBuffer::Step step = speaker.buffer.Pull();
    VoiceFrame voice;
    switch (step.kind) {
      case JitterBuffer::Step::Kind::kNothing:
        continue;
      case JitterBuffer::Step::Kind::kMissing:
        speaker.decoder.Conceal(voice);
        break;
      case JitterBuffer::Step::Kind::kPacket:
        if (!speaker.decoder.Decode(step.opus, voice).ok()) continue;
        break;
    }
    any = true;
    for (std::size_t i = 0; i < kVoiceSamples; ++i) sum[i] += voice[i];
  }
  using Limits = std::numeric_limits<std::int16_t>;
  std::transform(sum.begin(), sum.end(), frame.begin(), [](std::int32_t sample) {
    return static_cast<std::int16_t>(
        std::clamp<std::int32_t>(sample, Limits::min(), Limits::max()));
  });
  return any;
}

void VoiceMixer::Clear() {
  const std::lock_guard lock(mutex_);
  speakers_.clear();
}

}  // namespace saccade
