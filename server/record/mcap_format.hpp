#pragma once

#include <absl/strings/string_view.h>
#include <zlib.h>

#include <cstdint>

/// Of https://mcap.dev/spec what writer and reader share.
namespace saccade::mcap {

inline constexpr absl::string_view kMagic("\x89MCAP0\r\n", 8);

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kMetadata = 0x0c,
  kMetadataIndex = 0x0d,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f
};

inline constexpr std::uint64_t kHeadBytes = 9;  // of a record: opcode and length
inline constexpr std::uint64_t kFooterBytes = kHeadBytes + 20;

inline std::uint32_t Crc(absl::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace saccade::mcap
