#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "shared/io/video_device.hpp"

namespace saccade {

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
