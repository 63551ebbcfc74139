#include "server/mount/drivers/dynamixel_protocol.hpp"

#include <algorithm>
#include <array>

namespace saccade::dynamixel {
namespace {

constexpr std::array<std::uint8_t, 4> kHeader = {0xFF, 0xFF, 0xFD, 0x00};
constexpr std::size_t kBeforeInstruction = 7;  // header, id, length
constexpr std::size_t kShortestLength = 4;     // of an answer: instruction, error, CRC
constexpr std::size_t kLongestLength = 512;    // no answer that we ask for comes near
constexpr std::uint8_t kStuffing = 0xFD;

constexpr std::array<std::uint16_t, 256> MakeTable() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000u) != 0 ? (crc << 1) ^ 0x8005u : crc << 1;
    table[byte] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
constexpr std::array<std::uint16_t, 256> kTable = MakeTable();

bool EndsInHeader(const Bytes& bytes, std::size_t begin) {
  const std::size_t n = bytes.size();
  return n >= begin + 3 && bytes[n - 3] == 0xFF && bytes[n - 2] == 0xFF && bytes[n - 1] == 0xFD;
}

/// Instruction and parameters with one byte more after each FF FF FD, so that no header is in them.
Bytes Stuff(Instruction instruction, std::span<const std::uint8_t> parameters) {
  Bytes stuffed = {static_cast<std::uint8_t>(instruction)};
  for (const std::uint8_t byte : parameters) {
    stuffed.push_back(byte);
    if (EndsInHeader(stuffed, 0)) stuffed.push_back(kStuffing);
  }
  return stuffed;
}

Bytes Unstuff(std::span<const std::uint8_t> stuffed) {
  Bytes plain;
  std::size_t since = 0;  // a stuffing byte does not begin another header
  for (std::size_t k = 0; k < stuffed.size(); ++k) {
    plain.push_back(stuffed[k]);
    if (EndsInHeader(plain, since) && k + 1 < stuffed.size() && stuffed[k + 1] == kStuffing) {
      ++k;
      since = plain.size();
    }
  }
  return plain;
}

}  // namespace

std::uint16_t Crc(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>((crc << 8) ^ kTable[((crc >> 8) ^ byte) & 0xFF]);
  }
  return crc;
}

void Append(Bytes& bytes, std::int64_t value, int size) {
  for (int k = 0; k < size; ++k) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
}

std::int64_t SignedAt(std::span<const std::uint8_t> bytes, std::size_t offset, int size) {
  std::uint64_t value = 0;
  for (int k = 0; k < size; ++k) {
    value |= std::uint64_t{bytes[offset + static_cast<std::size_t>(k)]} << (8 * k);
  }
  const int unused = 64 - 8 * size;
  return static_cast<std::int64_t>(value << unused) >> unused;
}

Bytes Encode(int id, Instruction instruction, std::span<const std::uint8_t> parameters) {
  const Bytes body = Stuff(instruction, parameters);
  Bytes packet(kHeader.begin(), kHeader.end());
  packet.push_back(static_cast<std::uint8_t>(id));
  Append(packet, static_cast<std::int64_t>(body.size() + 2), 2);
  packet.insert(packet.end(), body.begin(), body.end());
  Append(packet, Crc(packet), 2);
  return packet;
}

const char* ErrorText(int error) {
  switch (error) {
    case 0:
      return "no error";
    case 1:
      return "it failed to carry the instruction out";
    case 2:
      return "it does not know the instruction";
    case 3:
      return "the packet reached it damaged";
    case 4:
      return "the value is beyond its range";
    case 5:
      return "the value has the wrong length";
    case 6:
      return "the value is beyond its configured limits";
    case 7:
      return "this cannot be written now (torque on?), or at all";
    default:
      return "an unknown error";
  }
}

void AnswerParser::Add(std::span<const std::uint8_t> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<Answer> AnswerParser::Next() {
  while (true) {
    const auto begin = std::search(buffer_.begin(), buffer_.end(), kHeader.begin(), kHeader.end());
    if (begin == buffer_.end()) {
      // The beginning of a header may be the last that came.
      const std::size_t keep = std::min(buffer_.size(), kHeader.size() - 1);
      buffer_.erase(buffer_.begin(), buffer_.end() - static_cast<std::ptrdiff_t>(keep));
      return std::nullopt;
    }
    buffer_.erase(buffer_.begin(), begin);
    if (buffer_.size() < kBeforeInstruction) return std::nullopt;
    const std::size_t length = buffer_[5] | (std::size_t{buffer_[6]} << 8);
    const bool possible = length >= 3 && length <= kLongestLength;
    if (possible && buffer_.size() < kBeforeInstruction + length) return std::nullopt;
    const std::span<const std::uint8_t> all = buffer_;
    const std::size_t end = kBeforeInstruction + length;
    if (!possible || Crc(all.first(end - 2)) != (all[end - 2] | (std::size_t{all[end - 1]} << 8))) {
      ++corrupt_;
      buffer_.erase(buffer_.begin());  // a whole packet may begin within this one
      continue;
    }
    const Bytes body = Unstuff(all.subspan(kBeforeInstruction, length - 2));
    Answer answer{.id = all[4], .error = 0, .alert = false, .parameters = {}};
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(end));
    // What we sent ourselves comes back from some adapters.
    if (body[0] != static_cast<std::uint8_t>(Instruction::kStatus)) continue;
    if (length < kShortestLength || body.size() < 2) continue;
    answer.error = body[1] & 0x7F;
    answer.alert = (body[1] & 0x80) != 0;
    answer.parameters.assign(body.begin() + 2, body.end());
    return answer;
  }
}

}  // namespace saccade::dynamixel
