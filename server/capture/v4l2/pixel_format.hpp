#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

#include "server/capture/image_file.hpp"

namespace saccade {

/// How a driver lays out the pictures it gives.
struct V4l2Layout {
  std::uint32_t fourcc = 0;
  int width = 0, height = 0;  // px
  int stride = 0;             // bytes from line to line; of NV12 in both planes
};

/// Bytes that a whole picture has; 0 where that depends on the picture (MJPEG).
std::size_t WholeBytes(const V4l2Layout& layout);

/// A picture of its own memory. Grey of YUYV and NV12 is their luminance as it is: the tracker sees
/// what the sensor saw, without a detour over colour.
/// DataLoss: torn (too few bytes, JPEG without its end), damaged, or of another size.
absl::StatusOr<DecodedPicture> PictureFrom(const V4l2Layout& layout,
                                           std::span<const std::uint8_t> bytes);

}  // namespace saccade
