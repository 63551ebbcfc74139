#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace saccade {

/// The pictures of a folder, by name; other files are no error.
///   NotFound         no such folder, or no picture in it
///   InvalidArgument  not a folder
absl::StatusOr<std::vector<std::filesystem::path>> PicturesIn(const std::filesystem::path& folder);

/// One of them, grey; errors as LoadPicture's.
absl::StatusOr<cv::Mat> LoadGrey(const std::filesystem::path& file);

}  // namespace saccade
