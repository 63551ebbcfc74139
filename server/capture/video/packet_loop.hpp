#pragma once

#include <cstdint>

namespace saccade {

inline constexpr std::int64_t kMostPacketPixels = std::int64_t{1} << 25;

/// Decodes PacketHeader messages from standard input until its end, each at once: to each of them
/// one DecodeHeader message is the answer, kFrame or kAlive (no picture came of it, and `bad` says
/// whether that is a fault). Pictures of more than `most_pixels` are such faults. One thread, from
/// within the sandbox. Returns the exit code.
int DecodePackets(std::int64_t most_pixels);

}  // namespace saccade
