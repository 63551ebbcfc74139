#include "shared/audio/voice_mixer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace saccade {
namespace {

constexpr Timestamp kForgotten_ns = 10'000'000'000;
constexpr double kHeardLevel = 0.008;

}  // namespace

void VoiceMixer::Hear(const std::string& speaker, const std::vector<VoicePacket>& packets,
                      Timestamp now_ns) {
  const std::lock_guard lock(mutex_);
  auto known = speakers_.find(speaker);
  if (known == speakers_.end()) {
    if (speakers_.size() >= kMaxSpeakers) return;
    absl::StatusOr<OpusVoiceDecoder> decoder = OpusVoiceDecoder::Create();
    if (!decoder.ok()) return;
    known = speakers_.emplace(speaker, Speaker{*std::move(decoder), {}}).first;
  }
  known->second.heard_ns = now_ns;
  for (const VoicePacket& packet : packets) {
    known->second.buffer.Push(packet.sequence, packet.opus, now_ns);
  }
}

std::vector<std::string> VoiceMixer::Speaking(Timestamp now_ns, Timestamp within_ns) const {
  std::vector<std::string> who;
  const std::lock_guard lock(mutex_);
  for (const auto& [id, speaker] : speakers_) {
    if (speaker.loud_ns != 0 && now_ns - speaker.loud_ns < within_ns) who.push_back(id);
  }
  return who;
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
    if (LoudnessOf(voice) > kHeardLevel) speaker.loud_ns = now_ns;
    for (std::size_t i = 0; i < kVoiceSamples; ++i) sum[i] += voice[i];
  }
  using Limits = std::numeric_limits<std::int16_t>;
  std::transform(sum.begin(), sum.end(), frame.begin(), [](std::int32_t sample) {
    return static_cast<std::int16_t>(
        std::clamp<std::int32_t>(sample, Limits::min(), Limits::max()));
  });
  return any;
}

double LoudnessOf(const VoiceFrame& frame) {
  double sum = 0.0;
  for (const std::int16_t sample : frame) sum += static_cast<double>(sample) * sample;
  return std::sqrt(sum / kVoiceSamples) / 32768.0;
}

void VoiceMixer::Clear() {
  const std::lock_guard lock(mutex_);
  speakers_.clear();
}

}  // namespace saccade
