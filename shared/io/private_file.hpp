#pragma once

#include <absl/strings/string_view.h>

#include <filesystem>

namespace saccade {

/// Writes `data` into `file`, for its owner alone (0600) from its first moment on, in place of what
/// was there: whoever reads it meanwhile gets the old or the new, never half. On the disk when it
/// returns. The folder must exist. Returns 0 or errno.
[[nodiscard]] int WritePrivateFile(const std::filesystem::path& file, absl::string_view data);

}  // namespace saccade
