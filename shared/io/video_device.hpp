#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace saccade {

/// ioctl() on one opened video device (V4L2): all that a mount asks of the system, so that tests
/// can stand in for it.
class VideoDevice {
 public:
  virtual ~VideoDevice() = default;
  /// 0, or errno.
  virtual int Ioctl(unsigned long request, void* argument) = 0;
};
using OpenVideoDevice =
    std::function<absl::StatusOr<std::unique_ptr<VideoDevice>>(const std::string& path)>;

/// The same with what pictures need: mapped buffers and waiting.
class CaptureDevice : public VideoDevice {
 public:
  /// A buffer of the driver's, mapped until the device is closed. 0, or errno.
  virtual int Map(std::size_t length, std::uint32_t offset, std::span<const std::uint8_t>* out) = 0;
  /// Until a buffer is ready, at most so long: 0, ETIMEDOUT, ENODEV if the device is gone or does
  /// not stream, or another errno.
  virtual int Wait(int most_ms) = 0;
};
using OpenCaptureDevice =
    std::function<absl::StatusOr<std::unique_ptr<CaptureDevice>>(const std::string& path)>;

/// The real ones. NotFound, PermissionDenied, Unavailable: names device and remedy.
absl::StatusOr<std::unique_ptr<VideoDevice>> OpenRealVideoDevice(const std::string& path);
absl::StatusOr<std::unique_ptr<CaptureDevice>> OpenRealCaptureDevice(const std::string& path);

}  // namespace saccade
