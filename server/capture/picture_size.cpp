#include "server/capture/picture_size.hpp"

#include <algorithm>

#include "server/capture/image_file.hpp"

namespace saccade {

std::optional<cv::Size> SizeOfFirstPicture(const std::filesystem::path& folder,
                                           const std::vector<ImageEntry>& entries,
                                           std::uint64_t first) {
  constexpr std::uint64_t kTries = 50;
  const std::uint64_t end = std::min<std::uint64_t>(entries.size(), first + kTries);
  for (std::uint64_t i = first; i < end; ++i) {
    const absl::StatusOr<DecodedPicture> picture = LoadPicture(folder / entries[i].file);
    if (picture.ok()) return picture->grey.size();
  }
  return std::nullopt;
}

}  // namespace saccade
