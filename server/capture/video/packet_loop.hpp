#pragma once

namespace saccade {

/// Decodes PacketHeader messages from standard input until its end, each at once: to each of them
/// one DecodeHeader message is the answer, kFrame or kAlive (no picture came of it, and `bad` says
/// whether that is a fault). One thread, from within the sandbox. Returns the exit code.
int DecodePackets();

}  // namespace saccade
