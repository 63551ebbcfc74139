#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <optional>

namespace saccade {

/// Frames from `first` to before `end`; no end means all that follow.
struct FrameRange {
  std::uint64_t first = 0;
  std::optional<std::uint64_t> end;
};

/// "A:B", "A:", ":B" or nothing (all). InvalidArgument: anything else, or an empty range; the
/// message names `option`.
absl::StatusOr<FrameRange> ParseFrameRange(absl::string_view text,
                                           absl::string_view option = "--frames");

}  // namespace saccade
