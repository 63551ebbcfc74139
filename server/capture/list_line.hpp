#pragma once

#include <absl/strings/string_view.h>

#include <string>

namespace saccade {

/// What is wrong with a whole list of pictures, with the remedy: UTF-16, a Git LFS pointer. Empty
/// if it looks like text.
std::string WhatIsWrongWithList(absl::string_view text);

/// What is wrong with a line that should be `SECONDS FILE`, with the remedy: commas, quotes, no
/// time, columns of an association or a trajectory. Empty if nothing is known to be. `line`: not
/// empty, no comment, stripped of spaces.
std::string WhatIsWrongWithLine(absl::string_view line);

}  // namespace saccade
