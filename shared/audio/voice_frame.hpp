#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// What voice is made of here: 48 kHz, mono, 16 bit, 20 ms at a time (proto: VoicePacket).
inline constexpr int kVoiceRate_hz = 48'000;
inline constexpr std::size_t kVoiceSamples = 960;
inline constexpr std::int64_t kVoiceFrame_ns = 20'000'000;
using VoiceFrame = std::array<std::int16_t, kVoiceSamples>;

/// One frame coded.
struct VoicePacket {
  std::uint64_t sequence = 0;  // rises by one each 20 ms of one speaker, silence included
  Timestamp capture_ns = 0;    // of its first sample
  std::string opus;
};

/// Root mean square, 0 to 1.
double LoudnessOf(const VoiceFrame& frame);

}  // namespace saccade
