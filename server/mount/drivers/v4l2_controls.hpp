#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace saccade {

/// ioctl() on one opened video device: all that the driver asks of the system, so that tests can
/// stand in for it.
class VideoDevice {
 public:
  virtual ~VideoDevice() = default;
  /// 0, or errno.
  virtual int Ioctl(unsigned long request, void* argument) = 0;
};
using OpenVideoDevice =
    std::function<absl::StatusOr<std::unique_ptr<VideoDevice>>(const std::string& path)>;

/// The real one. NotFound, PermissionDenied, Unavailable: names device and remedy.
absl::StatusOr<std::unique_ptr<VideoDevice>> OpenRealVideoDevice(const std::string& path);

/// Controls of one V4L2 device, by their V4L2_CID_ numbers. One thread. Errors name device and
/// control: Unavailable, the device is gone; FailedPrecondition, it refuses.
class V4l2Controls {
 public:
  V4l2Controls(std::string path, std::unique_ptr<VideoDevice> device)
      : path_(std::move(path)), device_(std::move(device)) {}

  struct Range {
    std::int32_t least = 0, most = 0, step = 1;
  };
  /// Nothing: the device does not have it, or it is disabled (VIDIOC_QUERYCTRL).
  absl::StatusOr<std::optional<Range>> Query(std::uint32_t id);
  struct Value {
    std::uint32_t id;
    std::int32_t value;
  };
  /// All in one VIDIOC_S_EXT_CTRLS, so that pan and tilt start together.
  absl::Status Set(const std::vector<Value>& values);
  absl::StatusOr<std::int32_t> Get(std::uint32_t id);

 private:
  absl::Status Problem(int error, std::uint32_t id, const char* what) const;

  const std::string path_;
  std::unique_ptr<VideoDevice> device_;
};

}  // namespace saccade
