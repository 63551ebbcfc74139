#pragma once

#include <string>
#include <string_view>

namespace saccade {

/// What a file is that stands where another was expected, with the remedy: "is a Git LFS pointer,
/// not the file: run `git lfs pull`", by its first bytes. Empty if it is nothing known.
std::string NameOfStray(std::string_view data);

}  // namespace saccade
