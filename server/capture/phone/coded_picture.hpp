#pragma once

#include <cstdint>
#include <string>

#include "server/capture/decode_protocol.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// One picture as a phone sends it. Nothing of it is to be believed.
struct CodedPicture {
  std::uint64_t picture_id = 0;  // the phone's own count
  PacketHeader::Codec codec = PacketHeader::kH264;
  bool key_frame = false;
  Timestamp capture_ns = 0;  // the phone's clock
  int clockwise_deg = 0;     // 0, 90, 180 or 270: what turns it to lie as its sensor does
  std::string data;
  Timestamp received_ns = 0;  // MonotonicNow() when it was whole in memory
};

}  // namespace saccade
