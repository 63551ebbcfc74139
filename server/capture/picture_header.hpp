#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

namespace saccade {

/// Size of a picture by the header of its file alone: a few bytes of it can claim gigabytes, and
/// decoders take them at their word.
/// DataLoss: not PNG, JPEG, PNM (P1 to P6), BMP, TIFF or WebP, or its header is damaged.
absl::StatusOr<cv::Size> ReadPictureSize(std::span<const std::uint8_t> data);

}  // namespace saccade
