#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

namespace saccade::tools {

constexpr std::size_t kMaxTextBytes = 500;  // annotation.proto

/// One line without control characters, as the server takes it.
std::string CleanText(const std::string& text);

/// A check list as it was written.
struct WrittenList {
  std::string title;
  std::vector<std::string> items;
};
/// `lines`: a thing to do in each; empty ones do not count.
///   InvalidArgument  what of it cannot be kept, in words
absl::StatusOr<WrittenList> ReadList(const std::string& title, const std::string& lines);

}  // namespace saccade::tools
