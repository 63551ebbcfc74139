#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace saccade::dynamixel {

// Packets of Dynamixel Protocol 2.0, as its manual describes them: header FF FF FD 00, id, length,
// instruction, parameters, CRC-16; all numbers little endian. Pure functions of bytes.

using Bytes = std::vector<std::uint8_t>;

enum class Instruction : std::uint8_t {
  kPing = 0x01,
  kRead = 0x02,
  kWrite = 0x03,
  kStatus = 0x55,
  kSyncRead = 0x82,
  kSyncWrite = 0x83,
};
inline constexpr int kBroadcast = 0xFE;
inline constexpr int kMaxId = 252;

/// CRC-16 with polynomial 0x8005, start 0, not reflected.
std::uint16_t Crc(std::span<const std::uint8_t> bytes);

/// One instruction packet, stuffed and closed with its CRC.
Bytes Encode(int id, Instruction instruction, std::span<const std::uint8_t> parameters);

/// Little endian, `size` bytes of it.
void Append(Bytes& bytes, std::int64_t value, int size);
/// `size` bytes at `offset`, which the caller has checked; signed, two's complement.
std::int64_t SignedAt(std::span<const std::uint8_t> bytes, std::size_t offset, int size);

/// What a servo answers.
struct Answer {
  int id = 0;
  int error = 0;       // 0: done; otherwise ErrorText knows
  bool alert = false;  // the servo's hardware error status is not zero
  Bytes parameters;
};

/// "the value is beyond the servo's range" ...
const char* ErrorText(int error);

/// Finds answers in a stream of bytes that may lack some, hold strange ones, or echo what was sent.
class AnswerParser {
 public:
  void Add(std::span<const std::uint8_t> bytes);
  /// The next whole answer with a right CRC; nothing: more bytes are needed.
  std::optional<Answer> Next();
  void Clear() { buffer_.clear(); }
  /// Packets given up because of their CRC or length.
  std::uint64_t corrupt() const { return corrupt_; }

 private:
  Bytes buffer_;
  std::uint64_t corrupt_ = 0;
};

}  // namespace saccade::dynamixel
