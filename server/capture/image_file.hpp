#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <span>

namespace saccade {

/// One decoded picture: `grey` CV_8UC1, never empty; `color` CV_8UC3 BGR, empty if the file is
/// grey.
struct DecodedPicture {
  cv::Mat grey;
  cv::Mat color;
};

/// Largest picture that is decoded: 8K video fits.
inline constexpr int kMaxPictureSide_px = 8192;
inline constexpr std::int64_t kMaxPicturePixels = std::int64_t{1} << 25;

/// What a caller has against a picture of this size; its error becomes LoadPicture's.
using SizeCheck = std::function<absl::Status(cv::Size)>;

/// Decodes an 8-bit grey or colour image file (PNG, JPEG, PNM, BMP, TIFF, WebP). Never throws.
///
/// The size is read from the header and checked, against the limits above and by `check`, before
/// anything is decoded: a file of a megabyte may ask for gigabytes. JPEG decoders fill the missing
/// rest of a truncated file with grey and report success, so the end of the file is checked first.
///   NotFound           no such file
///   DataLoss           truncated, damaged, not a regular file, not a picture, too large, not 8
///                      bits a channel, or no memory for it
///   ResourceExhausted  no file descriptor is free: the file may be well, try again later
absl::StatusOr<DecodedPicture> LoadPicture(const std::filesystem::path& file,
                                           const SizeCheck& check = nullptr);

/// The same of bytes in memory. DataLoss.
absl::StatusOr<DecodedPicture> DecodePicture(std::span<const std::uint8_t> bytes,
                                             const SizeCheck& check = nullptr);

}  // namespace saccade
