#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "server/capture/image_list.hpp"

namespace saccade {

/// Size of the first picture from `first` on that can be read; nothing if none can.
std::optional<cv::Size> SizeOfFirstPicture(const std::filesystem::path& folder,
                                           const std::vector<ImageEntry>& entries,
                                           std::uint64_t first);

}  // namespace saccade
