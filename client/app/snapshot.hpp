#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>

#include "client/net/types.hpp"

namespace saccade::app {

/// A PNG with a text of its own under `keyword` (an iTXt chunk, UTF-8), before its end. `png` is
/// whole. InvalidArgument: it is not.
absl::StatusOr<std::string> WithText(const std::string& png, const std::string& keyword,
                                     const std::string& text);

/// Where pictures are kept: $XDG_PICTURES_DIR, ~/Pictures if it is there, else the home folder.
std::filesystem::path PicturesFolder();

/// Writes `still` (marks drawn in) as saccade-FRAME.png there, with frame, pose and marks as JSON
/// inside. Returns the file; Unavailable: it cannot be written.
absl::StatusOr<std::filesystem::path> KeepSnapshot(const net::Still& still,
                                                   const std::vector<Annotation>& marks,
                                                   const std::string& source,
                                                   const std::string& taken_by,
                                                   const std::filesystem::path& folder);

}  // namespace saccade::app
