#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace saccade {

/// What voice is made of here: 48 kHz, mono, 16 bit, 20 ms at a time (proto: VoicePacket).
inline constexpr int kVoiceRate_hz = 48'000;
inline constexpr std::size_t kVoiceSamples = 960;
inline constexpr std::int64_t kVoiceFrame_ns = 20'000'000;
using VoiceFrame = std::array<std::int16_t, kVoiceSamples>;

}  // namespace saccade
