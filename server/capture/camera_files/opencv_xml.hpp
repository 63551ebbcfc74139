#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

namespace saccade {

/// OpenCV's XML (`<opencv_storage>`) as YAML with every value on the line that it had.
/// InvalidArgument: not that; the message begins ":LINE: ", for a file name before it.
absl::StatusOr<std::string> YamlOfOpenCvXml(absl::string_view xml);

}  // namespace saccade
