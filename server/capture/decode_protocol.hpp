#pragma once

#include <cstdint>

namespace saccade {

/// What saccade-decode writes to its standard output: this, then `size` bytes. Both ends are of one
/// build, on one machine.
struct DecodeHeader {
  static constexpr std::uint32_t kMagic = 0x53434431;
  enum Kind : std::uint32_t {
    kInfo = 1,   // once, first: width, height, fps; the text is the codec's name
    kFrame = 2,  // width * height * channels bytes, BGR or grey
    kAlive = 3,  // still at work, though there is no picture yet
    kEnd = 4,    // the video is over; `bad` counts
    kError = 5,  // nothing more comes; the text says why and what to do
  };
  std::uint32_t magic = kMagic;
  std::uint32_t kind = kAlive;
  std::uint32_t width = 0, height = 0;  // px
  std::uint32_t channels = 0;           // 3 or 1
  std::uint32_t size = 0;               // bytes that follow
  std::int64_t time_ns = 0;             // presentation time, of the video's own clock
  std::uint64_t bad = 0;                // packets so far that could not be decoded
  std::uint32_t clockwise_deg = 0;  // kInfo: 0, 90, 180, 270: what makes it upright, by the file
  double fps = 0;                   // 0: the video does not say
};

/// What `saccade-decode --packets` reads from its standard input, one after the other: this, then
/// `size` bytes of one coded picture.
struct PacketHeader {
  static constexpr std::uint32_t kMagic = 0x53434b31;
  static constexpr std::uint32_t kMostBytes = 1 << 20;
  enum Codec : std::uint32_t { kH264 = 1, kVp8 = 2 };
  std::uint32_t magic = kMagic;
  std::uint32_t codec = kH264;
  std::uint32_t key_frame = 0;
  std::uint32_t anew = 0;  // what came before was damaged: nothing of it is kept
  std::uint32_t size = 0;  // bytes that follow
  std::uint32_t unused = 0;
  std::int64_t time_ns = 0;  // comes back with its picture
};

/// Its standard input is the file, opened by whoever starts it: it can open none itself.
inline constexpr int kDecodeFile = 0, kDecodeOut = 1;

}  // namespace saccade
