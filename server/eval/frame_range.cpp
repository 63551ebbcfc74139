#include "server/eval/frame_range.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

namespace saccade {

absl::StatusOr<FrameRange> ParseFrameRange(absl::string_view text, absl::string_view option) {
  FrameRange range;
  if (text.empty()) return range;
  const auto refuse = [text, option] {
    return absl::InvalidArgumentError(
        absl::StrCat(option, " '", text,
                     "' is not a range A:B with A < B (half open, from zero), such as 0:100"));
  };
  const std::size_t colon = text.find(':');
  if (colon == absl::string_view::npos) return refuse();
  const absl::string_view first = text.substr(0, colon), end = text.substr(colon + 1);
  if (!first.empty() && !absl::SimpleAtoi(first, &range.first)) return refuse();
  std::uint64_t last = 0;
  if (!end.empty()) {
    if (!absl::SimpleAtoi(end, &last) || last <= range.first) return refuse();
    range.end = last;
  }
  return range;
}

}  // namespace saccade
