#pragma once

#include <absl/status/statusor.h>
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/capture/decode_protocol.hpp"

namespace saccade {

/// What is decoded: a file, which the child gets opened, or a URL.
struct VideoInput {
  std::filesystem::path file;
  std::string url;  // if there is no file

  std::string name() const { return file.empty() ? url : file.string(); }
};

/// One saccade-decode at work. It is killed with this object. One thread.
class DecoderProcess {
 public:
  /// `after_ns`: only frames later than this; -1 for all.
  ///   NotFound            no such file, or saccade-decode is not beside this program
  ///   InvalidArgument     not a regular file
  ///   ResourceExhausted   no descriptor or no process is to be had
  static absl::StatusOr<std::unique_ptr<DecoderProcess>> Start(const VideoInput& input,
                                                               std::int64_t after_ns);
  /// One that decodes what Write() gives it, packet by packet (PacketHeader); pictures of more than
  /// `most_pixels` are bad ones.
  static absl::StatusOr<std::unique_ptr<DecoderProcess>> StartPackets(std::int64_t most_pixels);
  ~DecoderProcess();

  pid_t pid() const { return pid_; }
  /// The next message without what follows it; that is ReadBytes' to fetch, all of it.
  ///   Cancelled         `stopped` says so (asked every tenth of a second)
  ///   DeadlineExceeded  it has not come whole in this time
  ///   Aborted           somebody has killed the child
  ///   Unavailable       it has died by itself, or writes nonsense: says how
  absl::StatusOr<DecodeHeader> ReadHeader(const std::function<bool()>& stopped,
                                          std::chrono::milliseconds most);
  /// Errors as ReadHeader.
  absl::Status Write(const void* data, std::size_t size, const std::function<bool()>& stopped,
                     std::chrono::milliseconds most);
  absl::Status ReadBytes(void* out, std::size_t size, const std::function<bool()>& stopped);
  /// The same, of bytes that nobody wants.
  absl::Status SkipBytes(std::size_t size, const std::function<bool()>& stopped);
  /// The text of a kInfo or kError, fit for a log.
  absl::StatusOr<std::string> ReadText(const DecodeHeader& header,
                                       const std::function<bool()>& stopped);

 private:
  DecoderProcess(pid_t pid, int pipe, int input) : pid_(pid), pipe_(pipe), input_(input) {}
  absl::Status Read(void* out, std::size_t size, const std::function<bool()>& stopped,
                    std::chrono::milliseconds most);
  absl::Status Death();

  const pid_t pid_;
  const int pipe_;
  const int input_;  // -1: its input is the file
  bool reaped_ = false;
};

}  // namespace saccade
