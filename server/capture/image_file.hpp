#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <opencv2/core.hpp>

namespace saccade {

/// One decoded picture: `grey` CV_8UC1, never empty; `color` CV_8UC3 BGR, empty if the file is
/// grey.
struct Picture {
  cv::Mat grey;
  cv::Mat color;
};

/// Decodes an 8-bit grey or colour image file (PNG, JPEG, PGM, whatever OpenCV reads).
///
/// JPEG decoders fill the missing rest of a truncated file with grey and report success, so the end
/// of the file is checked first.
///   NotFound   no such file
///   DataLoss   truncated, damaged, not a picture, or not 8 bits a channel
absl::StatusOr<Picture> LoadPicture(const std::filesystem::path& file);

}  // namespace saccade
