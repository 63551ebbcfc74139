#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace saccade {

/// A serial port, 8N1 without flow control, read and written with deadlines (Boost.Asio, which
/// stays in the .cpp). One thread.
class SerialLine {
 public:
  using Clock = std::chrono::steady_clock;

  /// NotFound, PermissionDenied, Unavailable: names device and remedy. InvalidArgument: the port
  /// cannot do `baud`.
  static absl::StatusOr<std::unique_ptr<SerialLine>> Open(const std::string& device, int baud);
  ~SerialLine();

  // Unavailable: the device is gone. DeadlineExceeded: there, but silent or stuck.
  absl::Status Write(std::span<const std::uint8_t> bytes, Clock::time_point deadline);
  /// Appends what has come, at least one byte.
  absl::Status Read(std::vector<std::uint8_t>& bytes, Clock::time_point deadline);
  /// Throws away what has come so far.
  void DropInput();

 private:
  struct Port;
  explicit SerialLine(std::unique_ptr<Port> port);
  std::unique_ptr<Port> port_;
};

}  // namespace saccade
