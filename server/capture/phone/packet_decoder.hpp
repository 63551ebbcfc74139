#pragma once

#include <absl/status/statusor.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>

#include "server/capture/decode_protocol.hpp"
#include "server/capture/video/decoder_process.hpp"
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
  Timestamp received_ns = 0;     // MonotonicNow() when it was whole in memory
  std::uint64_t generation = 0;  // PhoneSource's: of which Begin() its link is
};

/// What came of one packet.
struct DecodedPacket {
  std::uint64_t picture_id = 0;
  cv::Mat pixels;        // CV_8UC3 BGR or CV_8UC1; empty: none came of it
  bool damaged = false;  // what follows is of no use before the next key frame
  cv::Size refused;      // what came is of this size, another one than wanted: no pixels
};

/// Coded pictures to pictures, one out for one in, by a saccade-decode of its own: the bytes come
/// from outside. One thread, but for decoder_pid().
class PacketDecoder {
 public:
  /// Of pictures of `size`, or of it with its sides swapped.
  PacketDecoder(cv::Size size, std::function<bool()> stopped)
      : size_(size), stopped_(std::move(stopped)) {}

  /// `anew`: forget what came before. After an error the next one is decoded by a new process, from
  /// its key frame on:
  ///   Cancelled    stopped
  ///   Unavailable  the decoder died, or hung; others as DecoderProcess
  absl::StatusOr<DecodedPacket> Decode(const CodedPicture& packet, bool anew);

  pid_t decoder_pid() const { return pid_; }
  std::uint64_t restarts() const { return restarts_; }

 private:
  absl::Status Ask(const CodedPicture& packet, bool anew, std::chrono::milliseconds most);
  absl::StatusOr<DecodedPacket> Answer(const CodedPicture& packet, std::chrono::milliseconds most);

  const cv::Size size_;
  const std::function<bool()> stopped_;
  std::unique_ptr<DecoderProcess> process_;  // null: to be started
  std::atomic<pid_t> pid_ = 0;
  std::atomic<std::uint64_t> restarts_ = 0;
  bool started_ = false;
  std::uint64_t bad_of_process_ = 0;
};

}  // namespace saccade
